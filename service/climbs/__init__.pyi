from .asking import Sought as Sought, climb_end as climb_end, demo_request as demo_request
from .files import (
    write_route as write_route,
    write_search as write_search,
    write_stance as write_stance,
)
from .listing import print_routes as print_routes
from .seeking import seek as seek
from .verdict import climb_status as climb_status, print_verdict as print_verdict
