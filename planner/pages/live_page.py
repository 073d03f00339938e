"""Page of a stance that a person changes in the browser, and what changes on it."""

from __future__ import annotations

from typing import Any

from planner.pages.advice_data import advice_data
from planner.pages.documents import document
from planner.pages.plan_page import shown_plan
from planner.pages.scenes import Meshes
from planner.question import Question
from planner.result import Plan

__all__ = ["LivePage"]


class LivePage:
    """Page of plans that replace each other.

    Parameters
    ----------
    title : str
        Title of the page.
    """

    def __init__(self, title: str) -> None:
        self._title, self._links = title, Meshes()

    def document(self, plan: Plan, question: Question, live: dict[str, Any]) -> str:
        """Return the page with its first plan, as HTML that loads nothing else.

        Parameters
        ----------
        plan : Plan
            Any status.
        question : Question
            Question that the plan answers.
        live : dict of str to object
            What ``live.js`` needs to know.

        Raises
        ------
        UnsupportedError
            If plotly is not installed.
        """
        meshes = self._meshes(question)
        shown = shown_plan(plan, question, meshes)
        data = {"stages": [shown], "meshes": meshes.packed, "said": meshes.said}
        return document(self._title, data | {"live": live | {"kept": len(self._links.packed)}})

    def update(self, plan: Plan, question: Question, *, brief: bool) -> dict[str, Any]:
        """Return a plan that replaces the one on the page, as plain data.

        Parameters
        ----------
        plan : Plan
            Any status.
        question : Question
            Question that the plan answers.
        brief : bool
            As of `shown_plan`.

        Returns
        -------
        dict of str to object
            ``stage``: what the page shows; ``meshes``: those that follow the links' meshes.
        """
        meshes = self._meshes(question)
        shown = shown_plan(plan, question, meshes, brief=brief)
        return {"stage": shown, "meshes": meshes.packed[len(self._links.packed) :]}

    def advice(self, plan: Plan, question: Question) -> list[dict[str, Any]]:
        """Return the advice of a plan, as plain data.

        Parameters
        ----------
        plan : Plan
            With advice.
        question : Question
            Question that the plan answers.
        """
        return advice_data(plan, question) or []

    def _meshes(self, question: Question) -> Meshes:
        """Return the links' meshes, which the page keeps, for those of a plan to follow."""
        self._links.links_of(question.stance.robot)
        return self._links.more()
