from .climb_page import write_climb_page as write_climb_page
from .documents import document as document
from .holds_page import PlaceGroup as PlaceGroup, write_holds_page as write_holds_page
from .live_page import LivePage as LivePage
from .plan_page import write_plan_page as write_plan_page
from .plan_rows import PageTable as PageTable, plan_tables as plan_tables
from .route_page import write_route_page as write_route_page
from .scenes import Meshes as Meshes, scene_data as scene_data
from .wrench_slices import WrenchSlice as WrenchSlice, wrench_slice as wrench_slice
