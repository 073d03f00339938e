from .filled_holes import FilledCells as FilledCells, filled_cells as filled_cells
from .holds import Hold as Hold
from .mesh import Mesh as Mesh
from .mesh_files import (
    MESH_ENDINGS as MESH_ENDINGS,
    read_mesh as read_mesh,
    read_vertices as read_vertices,
)
from .profile import Profile as Profile
from .shapes import (
    Cylinder as Cylinder,
    Edge as Edge,
    Ellipsoid as Ellipsoid,
    Plane as Plane,
    Sphere as Sphere,
)
from .smoothing import load_compiled as load_compiled
from .surface import Triangles as Triangles, drawn_out as drawn_out, grid as grid
from .triangles import (
    TriangleCells as TriangleCells,
    connected as connected,
    edges_of as edges_of,
    grouped as grouped,
    weld as weld,
)
