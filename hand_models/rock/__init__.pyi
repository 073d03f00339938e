from .filled_holes import FilledCells as FilledCells, filled_cells as filled_cells
from .generated import (
    RockSource as RockSource,
    generate_wall as generate_wall,
    read_rock as read_rock,
    wall_names as wall_names,
)
from .holds import (
    Cylinder as Cylinder,
    Edge as Edge,
    Ellipsoid as Ellipsoid,
    Hold as Hold,
    Plane as Plane,
    Sphere as Sphere,
)
from .mesh import Mesh as Mesh
from .mesh_files import (
    MESH_ENDINGS as MESH_ENDINGS,
    read_mesh as read_mesh,
    read_vertices as read_vertices,
)
from .profile import Profile as Profile
from .smoothing import load_compiled as load_compiled
from .surface import Triangles as Triangles, drawn_out as drawn_out, grid as grid
from .triangles import (
    TriangleCells as TriangleCells,
    connected as connected,
    edges_of as edges_of,
    grouped as grouped,
    weld as weld,
)
