from .filled_holes import FilledCells as FilledCells, filled_cells as filled_cells
from .holds import (
    Cylinder as Cylinder,
    Edge as Edge,
    Ellipsoid as Ellipsoid,
    Hold as Hold,
    Plane as Plane,
    Sphere as Sphere,
)
from .mesh import Mesh as Mesh, read_mesh as read_mesh
from .profile import Profile as Profile
from .triangles import Triangles as Triangles, drawn_out as drawn_out, grid as grid, weld as weld
