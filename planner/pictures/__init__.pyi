from .body_plots import plot_body_space as plot_body_space
from .climb_plots import plot_wall as plot_wall
from .com_plots import plot_com_region as plot_com_region
from .hand_plots import plot_wrench_space as plot_wrench_space
from .opening_plots import plot_opening as plot_opening
from .plan_plots import draw_plan as draw_plan, plot_plan as plot_plan
from .plan_scene import (
    WORLD_UP as WORLD_UP,
    DrawnScene as DrawnScene,
    DrawnSurface as DrawnSurface,
    drawn_scene as drawn_scene,
    joint_utilisations as joint_utilisations,
    view_directions as view_directions,
)
from .redundancy_plots import plot_redundancy as plot_redundancy
from .report import summary as summary, write_report as write_report
from .rock_patches import coarse as coarse
from .settings import PICTURE_SETTINGS as PICTURE_SETTINGS
from .survival_plots import (
    plot_route_survival as plot_route_survival,
    plot_survival as plot_survival,
)
