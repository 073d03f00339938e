from .tables import table_of as table_of
