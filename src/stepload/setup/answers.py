"""Answers from flags, an earlier start or a person, each checked where it is given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

from stepload.errors import BadInputError, RefusedError, guess, printable
from stepload.setup.questions import QUESTIONS, YES, Question
from stepload.units import parse_quantity

SEPARATOR = "\n"
"""Between the words KEY=VALUE of one answer."""


class DeclinedError(RefusedError):
    """A consent was not given: nothing was done, nothing was found (exit code 3)."""


class Person(Protocol):
    """The person who is informed of what is done, and may be asked."""

    def tell(self, line: str) -> None:
        """Say something."""
        ...

    def ask(self, question: Question) -> str | None:
        """An answer; None: nobody is there to give it."""
        ...


@dataclass(slots=True)
class Answers:
    """Answers by name, in order of precedence: given now, kept, asked for, default.

    Args:
        given: from flags.
        kept: from an earlier start; new ones are added.
        settled: those of them that stand; a person is asked for the others again, with the kept
            one as default: it may be what made its step fail.
        yes: consents are given beforehand.
        preset: answers to begin with, in the place of the questions' defaults.
    """

    given: Mapping[str, str]
    person: Person
    kept: dict[str, str] = field(default_factory=dict)
    settled: set[str] = field(default_factory=set)
    yes: bool = False
    preset: Mapping[str, str] = field(default_factory=dict)

    def text(self, name: str) -> str:
        """The answer to question `name`.

        Raises:
            BadInputError: there is none, or it cannot be used.
        """
        question = QUESTIONS[name]
        if name in self.preset:
            question = replace(question, default=self.preset[name])
        if name in self.given:
            answer = self.given[name]
        elif name in self.kept and not question.consent:
            answer = self.kept[name] if name in self.settled else self._again(question)
        elif (told := self._requested(question)) is not None:
            answer = told
        elif question.default is not None:
            answer = question.default
        else:
            raise BadInputError(
                f"{question.text}: there is no answer, and no terminal to ask at",
                hint=f"{question.flag} ANSWER",
            )
        if not question.consent:
            self.kept[name] = answer
            self.settled.add(name)
        return answer

    def _again(self, question: Question) -> str:
        kept = self.kept[question.name]
        told = self._requested(replace(question, default=kept.replace(SEPARATOR, ", ")))
        return kept if told is None else told

    def origin(self, name: str) -> str:
        """Where the answer to question `name` is from, as text for a comment."""
        answer = self.kept.get(name)
        if name not in self.given and answer == self.preset.get(name):
            return "preset, change it"
        return "default" if answer == QUESTIONS[name].default else "stated"

    def words(self, name: str) -> dict[str, str]:
        """An answer of words KEY=VALUE as a mapping."""
        pairs = (word.partition("=") for word in self.text(name).split(SEPARATOR) if word)
        return {key.strip(): value.strip() for key, _, value in pairs}

    def quantity(self, name: str, unit: str) -> float:
        """An answer in SI."""
        return parse_quantity(self.text(name), unit)

    def consent(self, name: str) -> None:
        """Go on only with the consent that `name` asks for.

        Raises:
            DeclinedError: it was not given.
            RefusedError: the question was about a fact, not for consent, and the answer is no.
        """
        question = QUESTIONS[name]
        if self.yes and name not in self.given:
            self.person.tell(f"{question.text} yes (--yes)")
            return
        if self.text(name).lower() not in YES:
            refused = RefusedError if question.fact else DeclinedError
            raise refused(
                f"{question.text} The answer was no",
                hint=f"nothing was moved; start again when it may, {question.flag} yes in scripts",
            )

    def _requested(self, question: Question) -> str | None:
        while (told := self.person.ask(question)) is not None:
            told = told.strip()
            if question.many:
                told = SEPARATOR.join(word.strip() for word in told.split(",") if word.strip())
            try:
                check(question, told)
            except BadInputError as error:
                self.person.tell(str(error))
                continue
            return told
        return None


def check(question: Question, answer: str) -> None:
    """Check that an answer can be used.

    Raises:
        BadInputError: it cannot, with what is expected.
    """
    if question.many:
        for word in answer.split(SEPARATOR):
            if word and "=" not in word:
                raise BadInputError(f"{word!r} is no KEY=VALUE", hint="port=/dev/ttyUSB0")
        keys = [word.partition("=")[0].strip() for word in answer.split(SEPARATOR) if word]
        if twice := next((key for key in keys if keys.count(key) > 1), None):
            raise BadInputError(f"{twice} is given twice", hint="keep one of the two")
        for key in keys:
            if part := next((each for each in keys if each.startswith(f"{key}.")), None):
                raise BadInputError(f"{key} and {part}, a key in it", hint="keep one of the two")
    elif not answer.strip() and question.default != "":
        raise BadInputError("an empty answer", hint=question.text)
    elif question.check is not None:
        question.check(answer)


def from_flags(words: Sequence[str]) -> dict[str, str]:
    """The answers of a command line: `--host 192.168.1.10`, `--keys a=b --keys c=d`.

    Raises:
        BadInputError: an unknown flag, one without its answer, or an answer that cannot be used.
    """
    flags = {question.flag: question for question in QUESTIONS.values()}
    answers: dict[str, str] = {}
    rest = list(words)
    while rest:
        flag, equals, answer = rest.pop(0).partition("=")
        if (question := flags.get(flag)) is None:
            raise BadInputError(
                f"{printable(flag)!r} is no question of the set-up",
                hint=f"{guess(flag, flags)}there are {', '.join(flags)}",
            )
        if not equals:
            if not rest:
                raise BadInputError(f"{flag}: its answer is missing", hint=question.text)
            answer = rest.pop(0)
        before = answers.get(question.name)
        if before is not None and not question.many:
            raise BadInputError(f"{flag} is given twice", hint="keep one of the two")
        joined = f"{before}{SEPARATOR}{answer}" if before and question.many else answer
        try:
            check(question, joined)
        except BadInputError as error:
            raise BadInputError(f"{flag}: {error.message}", hint=error.hint) from None
        answers[question.name] = joined
    return answers
