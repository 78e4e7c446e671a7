"""Which answer belongs to which question, whatever is late or lost."""

from hypothesis import given
from hypothesis import strategies as st

from stepload_drivers.ati.poller import ANSWER_S, SILENCE_S, Poller
from stepload_drivers.framing import CanFrame
from stepload_verify.emulators.ati import gauge_frames

PERIOD_S = 1e-3


def frames(number, time_s):
    first, second = gauge_frames(0, [number % 30000] + [0] * 5)
    return [CanFrame(0x200, first, time_s), CanFrame(0x201, second, time_s + 1e-4)]


class Bus:
    """A virtual bus: answers questions in turn, `delay_s` later unless told otherwise."""

    def __init__(self, poller):
        self.poller, self.now_s = poller, 10.0
        self.requested, self.waiting, self.got = 0, [], []

    def run(self, seconds, lose=(), delay_s=3e-4, late=None):
        late = late or {}
        end_s = self.now_s + seconds
        while self.now_s < end_s:
            arrived = [frame for at_s, frame in self.waiting if at_s <= self.now_s]
            self.waiting = [(a, f) for a, f in self.waiting if a > self.now_s]
            for frame in arrived:
                if answer := self.poller.feed(frame, self.now_s):
                    number = int.from_bytes(answer.first[2:4], "big")
                    self.got.append((answer.question, number))
            if self.poller.due(self.now_s):
                self.requested += 1
                last_s = self.waiting[-1][0] if self.waiting else 0.0
                at_s = max(self.now_s + late.get(self.requested, delay_s), last_s + 1e-4)
                for part, frame in enumerate(frames(self.requested, at_s)):
                    if (self.requested, part) not in lose and self.requested not in lose:
                        self.waiting.append((frame.time_s, frame))
            self.now_s += 1e-4


def test_one_late_answer_never_shifts_the_pairs_after_it():
    bus = Bus(Poller(0x20, PERIOD_S, 1e-3))
    bus.run(0.5, late={100: 0.015})
    assert all(question == number for question, number in bus.got)
    assert bus.poller.resyncs == 1
    assert bus.poller.late > 0
    assert len(bus.got) > 400


def test_a_lost_answer_is_noticed_and_put_right():
    bus = Bus(Poller(0x20, PERIOD_S, 1e-3))
    bus.run(0.5, lose={100})
    assert bus.poller.resyncs >= 1
    assert all(question == number for question, number in bus.got[-100:])


def test_a_torn_answer_is_an_orphan_and_is_put_right():
    bus = Bus(Poller(0x20, PERIOD_S, 1e-3))
    bus.run(0.5, lose={(100, 1)})
    assert bus.poller.orphans >= 1
    assert all(question == number for question, number in bus.got[-100:])


def test_after_a_time_out_nothing_is_asked_until_silence():
    poller = Poller(0x20, PERIOD_S, 1e-3)
    assert poller.due(10.0)
    assert not poller.due(10.0 + 2 * ANSWER_S)
    assert poller.stopped
    poller.feed(frames(1, 10.03)[0], 10.03)
    assert not poller.due(10.03 + 0.9 * SILENCE_S)
    assert poller.due(10.03 + 1.1 * SILENCE_S)
    assert (poller.timeouts, poller.late, poller.resyncs) == (1, 1, 1)


@given(
    st.lists(
        st.tuples(st.integers(0x1F0, 0x20F), st.binary(max_size=8), st.floats(0.0, 0.02)),
        max_size=60,
    )
)
def test_any_frames_at_any_time_give_only_whole_answers(events):
    poller, now_s = Poller(0x20, PERIOD_S, 1e-3), 5.0
    for frame_id, data, step_s in events:
        now_s += step_s
        poller.due(now_s)
        answer = poller.feed(CanFrame(frame_id, data, now_s), now_s)
        assert answer is None or (len(answer.first), len(answer.second)) == (8, 6)
        assert poller.pause_s(now_s) >= 0.0
