from .codec import (
    LARGEST_ERROR as LARGEST_ERROR,
    Answer as Answer,
    Format as Format,
    decode_request as decode_request,
    encode_error as encode_error,
    identifier as identifier,
    most_error_bytes as most_error_bytes,
)
from .errors import (
    REQUEST_KINDS as REQUEST_KINDS,
    BusyError as BusyError,
    CancelledError as CancelledError,
    LostError as LostError,
    MalformedError as MalformedError,
    NoServiceError as NoServiceError,
    ServiceError as ServiceError,
    ServiceTimeout as ServiceTimeout,
)
from .json_schema import schema as schema
from .keys import (
    DEFAULT_ROBOT as DEFAULT_ROBOT,
    ServiceName as ServiceName,
    server_key as server_key,
    service_key as service_key,
    shared_key as shared_key,
    stream_key as stream_key,
)
from .reading import read_reply as read_reply
from .sizes import (
    LARGEST_REQUEST as LARGEST_REQUEST,
    check_size as check_size,
    most_bytes as most_bytes,
)
from .validation_errors import (
    PossibleType as PossibleType,
    Step as Step,
    dotted as dotted,
    entered as entered,
    field_names as field_names,
    places_at as places_at,
)
