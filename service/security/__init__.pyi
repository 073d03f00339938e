from .folder import KeyFolder as KeyFolder, NamedKey as NamedKey
from .rights import Role as Role
