"""A contract for import-linter: from outside a room only its index is imported."""

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


class RoomContract(Contract):
    """Modules of ``package.room`` are imported by modules of that room only.

    What others need of a room they import from ``package.room`` itself, its ``__init__``.
    """

    type_name = "rooms"

    packages = fields.ListField(subfield=fields.StringField())

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Return the imports that reach past an index."""
        found = []
        for importer in sorted(graph.modules):
            for imported in sorted(graph.find_modules_directly_imported_by(importer)):
                room = ".".join(imported.split(".")[:2])
                inside = f"{importer}.".startswith(f"{room}.")
                if imported != room and imported.split(".")[0] in self.packages and not inside:
                    found.append(f"{importer} imports {imported}: import it from {room}")
        return ContractCheck(kept=not found, metadata={"found": found})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print those imports."""
        for line in check.metadata["found"]:
            output.print_error(line)


class FaceContract(Contract):
    """Modules of ``importer`` import from ``package`` itself, its index, and from no room of it."""

    type_name = "face"

    importer = fields.StringField()
    package = fields.StringField()
    besides = fields.SetField(subfield=fields.StringField(), required=False)

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Return the imports that reach past the index."""
        allowed = {self.package, *(self.besides or ())}
        found = [
            f"{importer} imports {imported}: import it from {self.package}"
            for importer in sorted(graph.find_descendants(self.importer) | {self.importer})
            for imported in sorted(graph.find_modules_directly_imported_by(importer))
            if imported.split(".")[0] == self.package and imported not in allowed
        ]
        return ContractCheck(kept=not found, metadata={"found": found})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print those imports."""
        for line in check.metadata["found"]:
            output.print_error(line)
