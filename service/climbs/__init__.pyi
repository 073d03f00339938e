from .asking import (
    Sought as Sought,
    climb_end as climb_end,
    demo_request as demo_request,
    part_of_whole as part_of_whole,
)
from .files import (
    write_route as write_route,
    write_search as write_search,
    write_stance as write_stance,
)
from .folders import ClimbFolder as ClimbFolder
from .listing import (
    Listing as Listing,
    climb_listing as climb_listing,
    route_listing as route_listing,
)
from .naming import naming_options as naming_options, with_options as with_options
from .pages import (
    with_spread as with_spread,
    write_page as write_page,
    write_search_page as write_search_page,
)
from .seeking import seek as seek
from .sources import Sources as Sources
from .verdict import (
    print_verdict as print_verdict,
    spread_of as spread_of,
    verdict_sentences as verdict_sentences,
)
