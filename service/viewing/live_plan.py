"""Plans of a stance while a person moves its body and hands, for a page in a browser."""

from __future__ import annotations

import contextlib
import threading
from pathlib import Path
from typing import Any

import msgspec
from msgspec import structs

import planner
from hand_models.base import CruxError, InvalidInputError, whole_file
from planner import deadline
from service import answering, requests
from service.viewing.moved_stance import MovableStance, StanceMoves
from service.viewing.settings import VIEWING_SETTINGS

__all__ = ["LivePlan"]


class LivePlan:
    """Plans of one stance, moved again and again, as data of a page; one at a time.

    Safe to use from several threads: a newer question ends a search for advice.

    Parameters
    ----------
    stance : MovableStance
    title : str
        Title of the page.
    file : Path
        Where the moved stance is saved.
    given : tuple of (bytes, PlanRequest, MeshFiles or None)
        The request's text, what it decodes to, and the mesh files that it names.
    """

    def __init__(
        self,
        stance: MovableStance,
        title: str,
        file: Path,
        given: tuple[bytes, requests.PlanRequest, answering.MeshFiles | None],
    ) -> None:
        self._stance, self._file, self._given = stance, file, given
        self._lock, self._stop = threading.Lock(), threading.Event()
        self._page = planner.LivePage(title)

    def prepare(self) -> None:
        """Plan the stance, and one with a hand that is moved: the first plans compile.

        Raises
        ------
        CruxError
            If the stance is impossible, or cannot be planned in time.
        """
        self.plan(StanceMoves(), brief=True)
        limb = self._stance.request.stance.hands[0].limb
        with contextlib.suppress(CruxError):
            self.plan(StanceMoves(hands={limb: (1e-4, 0.0, 0.0)}), brief=True)

    def document(self, **live: Any) -> str:
        """Return the page of the stance as it was given, as HTML.

        Parameters
        ----------
        **live
            What the page needs to know beside the plan.
        """
        question, plan = self._planned(StanceMoves(), brief=False)
        handles = self._stance.handles(question.stance)
        return self._page.document(plan, question, live | {"handles": handles})

    def plan(self, moves: StanceMoves, *, brief: bool) -> dict[str, Any]:
        """Return the plan of the moved stance as data that the page draws.

        Parameters
        ----------
        moves : StanceMoves
        brief : bool
            True to leave out proofs, slices of wrench spaces, tables, and the rock, which stays.

        Raises
        ------
        CruxError
            If the moved stance is impossible, or cannot be planned in time.
        """
        self._stop.set()
        question, plan = self._planned(moves, brief=brief)
        found = self._page.update(plan, question, brief=brief)
        return found | {"handles": self._stance.handles(question.stance)}

    def advice(self, moves: StanceMoves) -> list[dict[str, Any]] | None:
        """Return changes that help the moved stance; None if something newer was asked meanwhile.

        The search ends after `ViewingSettings.advice_timeout`.
        """
        question, plan = self._planned(moves, brief=False)
        with self._lock, deadline.within(VIEWING_SETTINGS.advice_timeout, stop=self._stop):
            try:
                advised = planner.with_advice(question, plan)
                shown = self._page.advice(advised, question)
            except planner.DeadlineError:
                return None
            return None if self._stop.is_set() else shown

    def close(self) -> None:
        """Wait until no plan is in work: a thread in a solver must not outlive the process."""
        self._stop.set()
        self._lock.acquire()

    def save(self, moves: StanceMoves) -> str:
        """Write the moved stance as a request of its own, and return the file's name.

        Other fields stay as they were given, and scans stay in their files.

        Raises
        ------
        InvalidInputError
            If the moved stance is impossible, or the file cannot be written.
        """
        text, before, files = self._given
        moved = self._stance.moved(moves)
        answering.question(moved, self._stance.robots)  # refuses what could not be read again
        if files is not None:
            moved = files.named(moved, before, self._file.parent)
        content = msgspec.json.format(answering.rewritten(text, before, moved))
        try:
            with whole_file(self._file) as part:
                part.write_bytes(content)
        except OSError as error:
            raise InvalidInputError(f"{self._file}: {error.strerror}", field="-o") from None
        return str(self._file)

    def _planned(self, moves: StanceMoves, *, brief: bool) -> tuple[planner.Question, planner.Plan]:
        request = self._stance.moved(moves)
        request = structs.replace(
            request, want=["load_factor"], draws=[], open_loop=None, survival=None
        )
        if brief:
            request = structs.replace(request, explain=False)
        with self._lock:
            self._stop.clear()
            question = answering.question(request, self._stance.robots)
            plan = planner.plan(question)
        if plan.status == "failed":
            raise InvalidInputError(plan.reason or "no plan passed its check")
        return question, plan
