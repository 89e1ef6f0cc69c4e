"""Judgements in words: what numbers mean, what to trust, where not, and what to do next."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.display import counted, listed, percent, percents
from ..models import SUPPORTED
from .marks import ENOUGH, FAIR, FAR_OFF, FEW, FORBIDDEN, MISFIT, OTHERWISE, PARTLY, UNITS, graded, no_better
from .marks import GOOD as GOOD
from .marks import MOSTLY as MOSTLY
from .marks import NEARBY as NEARBY
from .marks import SMALL as SMALL
from .marks import WIDTH as WIDTH
from .marks import Mark as Mark
from .marks import Verdict as Verdict
from .marks import allowed_by as allowed_by
from .marks import doubted as doubted

if TYPE_CHECKING:
    from ..constraints import LearntConstraint
    from .diagnosis import Diagnosis, Region

MORE = (
    "If one file holds several demonstrations, name the column that tells them apart with --group ('unconstrain "
    "inspect' finds it); else record the task again, held in other ways."
)
"""What helps against too few demonstrations."""

TOO_SLOW = Verdict(
    Mark.DOUBTFUL, "Too slow to be judged: all is below ten times its noise.", next="Score faster motion."
)

UNGUIDED = "Fit without --guided, which does better; or guide it to another goal or cycle, or show all of it."
"""What helps where guiding spoils a policy."""


def _explains(share: float, what: str = "held-out motion") -> str:
    return f"explains {percent(share)} of {what}" if share >= -1 else f"misses {what} by more than that motion itself"


def misses(share: float, noise: float) -> str:
    """What is left of a share of motion, as one of a typical action, and what noise alone makes, if believable."""
    missed = float(np.sqrt(max(1.0 - share, 0.0)))
    known = 0.005 <= noise <= 1.2 * missed  # more is constraints that change at every sample, not noise
    more = f" (noise, which turns slow motion, makes that {percent(min(noise, missed))} or more)" * known
    return f"misses {percent(missed)} of a typical action{more}"


def _advice(word: str, learnt: float, spoilt: bool) -> str:
    """What to do about a policy that explains so much of held-out motion, in a word, and of what it learnt from."""
    if spoilt:
        return UNGUIDED
    if word == "poor" and learnt >= GOOD:
        return (
            f"It explains {percent(learnt)} of what it learnt from: demonstrations that are held out go where no other "
            "does, or it is too flexible. Demonstrate between them, or try another --model."
        )
    return {
        "fair": "'unconstrain diagnose' says where it fails: by noise, which a wider --window takes out; by motion "
        "that starts or stops at once, which a narrower one, or --by kalman, follows; or as demonstrations have little "
        "in common.",
        "poor": "Look at the recordings ('unconstrain inspect'): columns, clocks or units may be wrong, or they have "
        "too little in common.",
    }.get(word, "Score it on recordings that were held in other ways ('unconstrain score').")


def of_untold(share: float) -> str:
    """Say at which share of the recorded states all recordings together leave the policy open."""
    if (said := percent(max(share, 0.0))) == "0%":
        return "all recordings together tell the policy at every recorded state"
    return f"at {said} of the recorded states no recording tells the policy in some direction, for this model"


def of_explained(
    share: float,
    demonstrations: int,
    determined: float | None = None,
    there: str = "",
    learnt: float = 0.0,
    lost: float | None = None,
    noise: float = 0.0,
    left_out: float = 0.0,
) -> Verdict:
    """Judge how much of held-out motion a policy explains, along the motion.

    ``share`` is 1 − the share left unexplained, NaN where nothing could be held out; fewer than three demonstrations
    give no verdict. ``determined`` is the share of the recorded states at which recordings tell the policy, and
    ``there`` what to record where fewer show it. ``learnt`` is the share of what was learnt from, and ``lost`` what
    guiding takes of that, None where it is not guided: a guided policy is judged by what is left, or worse. What
    is missed for ``noise`` alone is a share of a typical action. Where ``left_out``, the share missed where those
    held alike are left out together, is not 0, ``share`` is what to expect if one model holds.
    """
    across, little = "What constraints hid: no recording shows it, so no score does.", ""
    alone, share = share, share - (lost or 0.0)
    what = "motion like what was recorded, if one model holds for all" if left_out else "held-out motion"
    mark, word = graded(share, told=determined)
    if determined is not None and determined < MOSTLY and demonstrations >= ENOUGH:
        untold = of_untold(1 - determined)
        if allowed_by(determined) is not Mark.GOOD and word != "poor":  # which is so for another reason
            little = f"Recordings tell too little: {untold}. "
        across = f"Across the motion: {'as said first' if little else untold}"
        across += "." if there else "; 'unconstrain diagnose' says where."
    who, retold = "The policy" if lost is None else "The guided policy", ""
    if lost is not None and np.isfinite(share):
        same = "about as much" if not round(lost, 2) else f"{percent(alone)}, and {misses(alone, 0.0)}"
        retold = f" Unguided it {'misses more' if alone < -1 else f'explains {same}'}; what guiding takes is of what "
        retold += "it was fitted to, and says nothing of new starts."
    if demonstrations < ENOUGH or not np.isfinite(share):
        seen = f"{who} {_explains(share)}, but no" if np.isfinite(share) else "No"
        few = f"{seen} verdict: {_count(demonstrations)}, and a judgement takes {ENOUGH}."
        return Verdict(Mark.DOUBTFUL, few + retold, doubt=across, next=MORE)
    missed = f"where the policy predicts, it {misses(share, noise)}"
    advice = f"{_advice(word, learnt, mark is not graded(alone, told=determined)[0])} {there}".rstrip()
    if little:
        advice = there or "'unconstrain diagnose' says what to record."
    trust = "" if mark is Mark.BAD else f"Directions along recorded motion, near recorded states; {missed}."
    if left_out > 1.0 - FAIR:
        much = percent(1.0 - left_out) if left_out < 1.0 else "nothing"
        what += f"; where demonstrations that were held alike are left out together, it explains {much} of them"
        mark, word = no_better(mark), f"{word.partition(' ')[0]} along recorded motion, and no further"
    said = f"{little}{who} {_explains(share, what)}: {word}.{retold}"
    return Verdict(mark, said, trust, across, advice)


def of_score(
    share: float, demonstrations: int, under: float | None = None, learnt: int | None = None, told: float | None = None
) -> Verdict:
    """Judge how much of recordings that were not learnt from a policy explains; one is enough to see it fail.

    ``under`` is the same under their constraint, 1 − nCPE, said first where that is known; the smaller is judged. Of
    ``learnt`` of them, where that is known, the policy learnt; ``told`` is as ``determined`` in :func:`of_explained`,
    and makes any score doubtful where it is small: under the constraint given, too, others are not told.
    """
    mark, word = graded(share if under is None else min(share, under), told=told, under=under is not None)
    few = f" It takes {ENOUGH} recordings to be sure." if demonstrations < ENOUGH else ""
    who, motion = "The policy", "the motion" if learnt else "held-out motion"
    if under is not None:
        much = f"explains {percent(under)}" if under >= 0 else "misses more than all"
        who = f"In all directions left free by the constraint given, the policy {much} of the variance of {motion} "
        who += "(1 − nCPE). Along the recorded motion alone, it"
    untold = of_untold(1 - told) if told is not None and told < MOSTLY else ""
    more = (
        f"Movement under other constraints{untold and f': {untold}'}. Noise, and motion faster or slower than learnt, "
    )
    more += "count as missed in nCPE."
    if learnt:
        said = f"{who} {_explains(share, motion)}, but it learnt from {learnt} of "
        said += f"{_count(demonstrations)}: a score on what was learnt from is too good."
        return Verdict(Mark.DOUBTFUL, said, next="Hold some out of the fit (--leave-out, --episodes), and score these.")
    unknown = ", if none of it was learnt from" if learnt is None else ""
    across = f"Across the motion: {untold}" if untold else "What constraints hid in these recordings, too"
    across += ". Only motion along the recorded actions is judged; what held these recordings, given with --plane or "
    across += "--constraint (one by one, if each was held in its own way), tells more: all directions that were free."
    said, good = f"{who} {_explains(share)}{unknown}: {word}.", mark is Mark.GOOD
    trust = "" if mark is Mark.BAD else "Movement like this, along the directions that were recorded."
    other = "'unconstrain diagnose' says what to record."
    then = f"Score it under other constraints ('unconstrain score').{few}" if good else other
    return Verdict(mark, said, trust, across if under is None else more, then)


def of_worst(found: Verdict, shares: Mapping[str, float]) -> Verdict:
    """Add to a score which recordings by themselves are explained poorly, by name, and far worse than is usual."""
    far = min(FAIR, float(np.median([*shares.values()] or [GOOD])) - (GOOD - FAIR))
    poor = sorted((share, f"'{name}'") for name, share in shares.items() if share < far)
    if not poor:
        return found
    more = f", and {', '.join(name for _, name in poor[1:])} little better" if poor[1:] else ""
    then = f"Look whether these went wrong or were held otherwise ('unconstrain look'). {found.next}"
    return doubted(found, f"it {_explains(poor[0][0], f'{poor[0][1]} alone')}{more}")._replace(next=then)


def of_planes(found: Verdict, shares: Array, motion: Array) -> Verdict:
    """Add to a score what is explained in all directions of the plane that each recording kept to, NaN of others.

    Recordings count by their ``motion``, such as the sum of squared actions.
    """
    kept = np.isfinite(shares)
    if not kept.any():
        return found
    share = float(np.average(shares[kept], weights=motion[kept]))
    many = f"planes that {kept.sum()} of {_count(len(shares))} kept to"
    where = f"in all directions left free by the {'plane that it kept to' if len(shares) == 1 else many}, the policy "
    where += f"{_explains(share, 'the motion')} (said first: along the recorded motion alone)"
    if graded(share)[0] is Mark.GOOD:
        return found._replace(trust=f"{found.trust} {where[0].upper()}{where[1:]}.".lstrip())
    return doubted(found, f"{where}, unless more than a plane held {'it' if len(shares) == 1 else 'them'}")


def of_told(found: Verdict, told: float | None) -> Verdict:
    """Add to a verdict that recordings tell a policy at too small a share of their states, as :func:`of_explained`."""
    if allowed_by(told) is Mark.GOOD:
        return found
    return doubted(found, "across the motion recordings tell the policy too little")


def of_look(found: Verdict, across: Verdict) -> Verdict:
    """Say of how recordings look who judges what they tell; ``across`` adds what they plainly do not."""
    if across.doubt != found.doubt:
        across = doubted(across, "they tell no policy across their motion")
    return across._replace(said=f"{across.said} 'unconstrain diagnose' judges what recordings tell of a policy.")


def of_fit(found: Verdict, why: str) -> Verdict:
    """Add to a verdict on a movement why ``fit`` doubted its policy, the rest of a sentence, if anything."""
    then = found.next or "Look at the policy beside its demonstrations ('unconstrain look')."
    return doubted(found, f"as 'fit' said, {why}")._replace(next=then) if why else found


def of_unit(found: Verdict, times: float) -> Verdict:
    """Say first that units differ, where recordings are as many times as large as what a policy learnt from."""
    ratio, size = max(times, 1 / max(times, 1e-300)), "larger" if times > 1 else "smaller"
    if not (units := [f"{pair}: about {one:g} times" for pair, one in UNITS.items() if 1 / 3 < ratio / one < 3]):
        return found
    said = f"Recordings are {size} than what the policy learnt from, as in another unit ({units[0]}). {found.said}"
    return Verdict(Mark.BAD, said, doubt=found.doubt, next="Convert them to the unit of the policy.")


def of_units_apart(found: Verdict, said: str = "recordings are not all in one unit") -> Verdict:
    """Add to a verdict that recordings were not all in one unit, or what else is said of units."""
    then = "Do what the notes say, or leave out the recordings that they name, and begin again."
    first = f"{said[0].upper()}{said[1:]}, as the notes say."
    return found._replace(mark=no_better(found.mark), said=f"{first} {found.said}", next=then)


def of_glitches(found: Verdict, names: str) -> Verdict:
    """Add to a verdict that samples of some demonstrations, by name, are far off their neighbours."""
    said = f"samples of {names} jump far off their neighbours and back (glitches), and velocities about them are wrong"
    return doubted(found, said)._replace(next=f"Add --glitches drop, or repair if few are in a row. {found.next}")


def of_forbidden(found: Verdict, share: float) -> Verdict:
    """Add to a score under a constraint that it would not allow some share of the recorded motion, if much."""
    said = f"The constraint given forbids {percent(share)} of this motion: likely another held it. {found.said}"
    then = "Score without it, or give what held them ('unconstrain constraint' learns that)."
    return found if share <= FORBIDDEN else found._replace(mark=no_better(found.mark), said=said, next=then)


def shares_told(found: Diagnosis) -> str:
    """At which shares of their states recordings tell a policy, and how well: best first, together all of them."""
    parts = (three := found.states_determined), (hangs := max(found.told_together - three, 0.0)), 1.0 - three - hangs
    how = "three demonstrations or more tell the policy", "it hangs on one or two", "none tells it in some direction"
    said = [f"{much} {rest}" for much, rest in zip(percents(parts), how, strict=True)]
    told = [one for one, part in zip(said, parts, strict=True) if part > 1e-9 or one == said[0]]
    return f"at {' and at '.join(', at '.join(told).rsplit(', at ', 1))}".replace("%", "% of their states", 1)


def misfit(found: Diagnosis) -> float:
    """What a model misses of a typical action beyond the noise of recordings; 0 if that is not most, or small."""
    share = found.noise_share * float(np.sqrt(1.0 - min(found.jitter / max(found.noise, 1e-300), 1.0) ** 2))
    return share if found.noise >= MISFIT * found.jitter and share > SMALL else 0.0


def of_diagnosis(found: Diagnosis, first: str = "") -> Verdict:
    """Judge whether recordings tell the unconstrained policy; ``first`` is what to record, before the list of it."""
    share, count = found.states_determined, len(found.movements)
    doubt = "Where none tells it in some direction: free, or always held the same way, cannot be told there."
    doubt = doubt if found.told_together < 1.0 - 1e-9 else "States that nobody came near."
    if count < ENOUGH:
        said = f"No verdict: {_count(count)}; whether they were free cannot be told from fewer than {ENOUGH}."
        return Verdict(Mark.DOUBTFUL, said, doubt=doubt, next=MORE)
    mark, word = graded(share, MOSTLY, PARTLY)
    together = allowed_by(found.told_together)  # as 'fit' judges the same share, in the same words
    how = {"good": "enough", "fair": "enough in most places", "poor": "enough only if none of these went wrong"}
    said = f"Recordings: {shares_told(found)}: {how[word] if together is Mark.GOOD else 'too little for this model'}."
    if mark is Mark.BAD and together is not Mark.BAD:
        mark = Mark.DOUBTFUL
    elif found.planes == 1:
        said = f"{said[:-1]}, as all lie on one plane or on parallel ones."
    elif mark is Mark.BAD and found.planes:
        mark, said = Mark.DOUBTFUL, f"{said[:-1]} to be sure, though each lies on a plane of its own."
    if found.noise_share > 3 * SMALL:
        mark = no_better(mark)
        said = f"{said[:-1]}, though noise and misfit are {percent(found.noise_share)} of a typical action."
    spread = np.hypot(found.undetermined, found.from_noise)[found.told == 2]
    trust = f"The policy {'at these states' if share == 1 else 'where three or more tell it'}, to about "
    trust += f"{percent(np.linalg.norm(spread) / max(len(spread), 1) ** 0.5)} of a typical action, a standard deviation"
    if open_spread := share == 1 and (worst := found.regions[0].along) > SMALL:
        trust += f"; at the place that comes next, up to {percent(worst)}, where noise leaves more open"
    trust = f"{trust}." * (round(share, 2) > 0)
    if mark is not Mark.GOOD:
        doubt += " 'fit' and 'score' may still explain much: they judge a policy along the motion, this judges "
        doubt += "recordings across it."
    then = f"{first} The list below has more places.".lstrip()
    then = then if share < 1 or open_spread else "Demonstrate where nobody was."
    if missed := misfit(found):
        doubt += f" The model: beyond noise it misses {percent(missed)} of a typical action on average, in places "
        doubt += "more, unless people vary as much; 'may be off by' counts none of that."
        then += " Another --model of 'fit' may miss less, or more: compare by 'score' on recordings held back."
    return Verdict(mark, said, trust, doubt, then)


def ranked(found: Diagnosis) -> list[Region]:
    """Its regions; of those that all leave open last where a stroke passed that looks free, so needs no other there."""
    free = {one.name for one in found.movements if one.looks == "free"}
    return sorted(found.regions, key=lambda one: 2 if one.together >= PARTLY else one.demonstration in free)


FOLLOW = "Use it with --constraint of 'rollout' or 'score', which follow the mechanism."
"""What to do where files hold to mechanisms: nothing is missing of their form."""


LITTLE = "free strokes that turn as little keep to a surface of their own, too"
"""Why one stroke may have been free for all that its positions show."""


def of_constraint(learnt: LearntConstraint, *others: LearntConstraint, shown: bool | str | None = None) -> Verdict:
    """Judge a constraint, or one for each demonstration, by what it missed.

    ``shown`` is whether positions show it, None where they may be of free ones, too, and "free" where they surely are.
    """
    every = (learnt, *others)
    choice = max((one.choice_ for one in every), key=lambda each: each.held_out)
    missed, ranks = sum(one.choice_.held_out for one in every) / len(every), {one.rank_ for one in every}
    if max(ranks) == 0:
        said = "No direction was held: nothing constrained these movements, or each direction was seen."
        return Verdict(Mark.DOUBTFUL, said, next="Look whether the demonstrations were held in different ways.")
    single, followed = not others and not choice.several, all(getattr(one, "mechanism_", None) for one in every)
    many = f"That {' to '.join(map(str, sorted({min(ranks), max(ranks)})))} of {choice.actions} are held."
    if shown == "free":
        said = f"Positions say that nothing held {'it' if single else 'all of them'}."
        then = "Do not use it as a constraint, if these are positions."
        then += " Learn it of each alone (--episodes): some may have been held." * (not single)
        return Verdict(Mark.DOUBTFUL, said, doubt=many, next=then)
    one_way, alone = all(one.choice_.one_way for one in every), others or not choice.several
    straight = sum(one.choice_.wound is False for one in every) > len(every) / 2
    if not shown and (one_way or followed or (alone and straight)):
        why = LITTLE if straight else "a policy that keeps to this path by itself looks the same"
        why = "each state was passed one way only, as by a free policy" if one_way else why
        then = "Record movements that cross each other, and learn it again; or name the --features."
        then = f"{FOLLOW if followed else then} '{'diagnose' if single else 'fit'}' compares several with one policy, "
        said = f"Whether anything was held cannot be told{' by one demonstration alone' * single}: {why}."
        return Verdict(Mark.DOUBTFUL, said, doubt=many, next=f"{then}which may tell that they were held.")
    mark, word = graded(1.0 - missed)
    held = f"{'At most ' * (len(ranks) > 1)}{min(ranks)} of {choice.actions} directions were held"
    apart = f", others in each of {_count(len(every))}" if others else ""
    apart += f" (in some up to {max(ranks)} look so, as does a direction in which nobody moved)" * (len(ranks) > 1)
    undecided = " Positions do not decide it." if shown is False else ""
    said = f"{held}{apart}; {percent(missed)} of held-out motion is along them: {word}.{undecided}"
    then = FOLLOW if followed else "Use it with --constraint of 'rollout' or 'score'."
    if choice.several and not others and not followed and mark is not Mark.GOOD:
        said = f"If one constraint held all: {said}"
        then = "Learn it of each alone (--episodes, --leave-out): each may have been held otherwise, or not at all."
    mark = no_better(mark) if choice.doubts or len(ranks) > 1 or undecided else mark
    if choice.lacking and not followed:
        then = "Record what is missing, then learn it again."
    elif single and not followed:
        then = "Learn it from several demonstrations, from other starts: what one does not do looks held."
    doubt = "; ".join(text.rstrip(".") for text in choice.doubts).replace(", or name the features" * followed, "")
    still = "A direction in which nobody wanted to move looks held, too."
    return Verdict(mark, said, "What was held, near recorded states.", f"{doubt}. {still}" if doubt else still, then)


CONTRARY = 0.5
"""What lets pass more than this of a direction that a mechanism holds is no constraint of that mechanism."""


def of_passing(found: Verdict, passing: float, title: str) -> Verdict:
    """Add to a verdict on what was learnt how much it lets pass of what a mechanism holds, if much."""
    said = f"positions keep to {title}, and what was learnt lets pass {percent(passing)} of what that holds"
    other = "Learn it by other --features, as auto does."
    return found if passing <= CONTRARY else doubted(found, said)._replace(next=other)


def of_mechanism(found: Verdict, rank: int, named: Any, sure: bool) -> Verdict:
    """Say where velocities show some rank that positions keep to a mechanism that holds others; first if sure."""
    more = f"{named.rank} of {len(named.centre)}"
    if named.rank == rank or (named.rank < rank and not (sure and found.said.startswith(f"{named.rank} of "))):
        return found
    if not sure:
        keep = f"Positions may keep to {named.title}, which holds {more}; as it turns, velocities show less of it."
        return found._replace(said=f"{found.said} {keep}")
    why = "It turns on the way" if named.rank > rank else "It was passed one way only"
    said = f"{more} directions were held, by {named.title}. {why}, so velocities alone show {rank}"
    return found._replace(said=said + found.said.partition(" directions were held")[2], next=FOLLOW)


def of_files(found: Verdict, *held: LearntConstraint) -> Verdict:
    """Add to a verdict on constraints what their files hold to: mechanisms, or what was learnt."""
    named, (first, *others) = [one.mechanism_ for one in held if one.mechanism_], held
    what = f"the mechanism, {named[0].title}" if named else f"what was learnt, by {first.choice_.name} features"
    said = f"The file holds to {what}: {first.rank_} of {first.choice_.actions} directions."
    each = f"{len(named) or 'None'} of the {len(held)} files hold to mechanisms, the others to what was learnt."
    each = f"All {len(held)} files hold to mechanisms." if len(named) == len(held) else each
    return found._replace(said=f"{found.said} {each if others else said}")


def of_support(support: Array, times: Array | None, unknown: Array | None = None) -> Verdict:
    """Judge a movement of a policy by how near data is along it, (T,) each; times are steps where not known.

    ``unknown`` is how much of each action no recording tells, as a standard deviation, as a share of a typical one.
    """
    seconds = np.arange(len(support), dtype=np.float64) if times is None else times
    away, every = support < NEARBY, f"Near demonstrations for all {seconds[-1]:.2f} s"
    first, brief, lasting = int(away.argmin()), 0.01, 0.1  # the last two are shares of all
    if 0 < first == away.sum() < brief * len(away) and support.min() >= SUPPORTED:
        away, every = np.zeros_like(away), f"{every} but the first {seconds[first]:.2g} s"
    open_ = np.zeros_like(away) if unknown is None else (unknown > SMALL) & ~away
    if not (off := away | open_).any():
        return Verdict(Mark.GOOD, f"{every}: supported.")
    begins = f"{seconds[int(off.argmax())]:.2f} s"
    trust = f"The first {begins}." if off.argmax() and unknown is not None else ""
    mark = Mark.BAD if (support < SUPPORTED).mean() > 0.5 else Mark.DOUBTFUL
    none = f"No demonstration passes near for {_part(away, seconds)}: extrapolated."
    if unknown is None or not open_.any():
        doubt = f"All from {begins} on: where none passes, and after it."
        doubt = doubt if away[-1] or away.mean() >= lasting else f"Where none passes (first at {begins})."
        return Verdict(mark, none, trust, doubt, "Start nearer, or demonstrate there.")
    middle, worst = float(np.median(unknown[open_])), seconds[int(np.where(open_, unknown, 0.0).argmax())]
    said = f"{none} Near some" if away.any() else "Near demonstrations"
    said += f", but {_part(open_, seconds)}, fewer than {ENOUGH} tell the policy in every direction: "
    much = f"about {percent(middle)} of" if middle < 1 else "as much as"
    said += f"there its action, all coordinates together, may be off by {much} its typical one on this way, a standard "
    said += f"deviation, and a coordinate that moves little by far more of its own; most at {worst:.2f} s."
    doubt = f"Directions that fewer than {ENOUGH} demonstrations tell, from {begins} on."
    return Verdict(mark, said, trust, doubt, "'unconstrain diagnose' says what to record.")


def _part(where: NDArray[np.bool_], seconds: Array) -> str:
    return f"{percent(where.mean())} of the time, first at {seconds[int(where.argmax())]:.2f} s"


LAST = "last round over first"
"""A ratio of sizes."""

_WRONG = {"size": ("too large", "too small", ""), "pace": ("too fast", "too slow", "the other way")}
_OFF = np.log(OTHERWISE) + 0.005  # the bounds as they are printed are not beyond
_WRONG[LAST] = "too large", "too small", ""


def of_replays(found: Verdict, said: str, strays: Sequence[str], starts: str = "the same starts") -> Verdict:
    """Add to a verdict how a policy moves from the starts of demonstrations, held as they were: :func:`moves`."""
    if not strays:
        return found._replace(said=f"{found.said} Run from {starts}, {said}." if said else found.said)
    return doubted(found, f"run from {starts}, {said}")._replace(
        doubt=f"Its {' and '.join(strays)} over time. {found.doubt}".rstrip(),
        next="Look at it ('unconstrain look'). More demonstrations may come nearer.",
    )


def moves(extents: Array, paces: Array, lasts: Any = (), names: Sequence[str] = ()) -> tuple[str, list[str]]:
    """How runs move, the rest of a sentence, empty without any; and in what they stray.

    ``extents`` and ``paces`` are size and turns of each run over those of its demonstration, NaN where there are none,
    and ``lasts`` the size of the last round over that of the first, over the same; ``names`` are those of runs.
    A quarter (of two, one) may be off by :data:`OTHERWISE` either way, which nearly keeps them, but none by
    :data:`FAR_OFF`.
    """
    measured, many = _measured(extents, paces, lasts, names=names), len(extents)
    goes = ("go round" if many > 1 else "goes round") if "pace" in measured else f"turn{'s' * (many == 1)} out"
    said, strays = list[str](), list[str]()
    for name, (ratios, off, beyond) in measured.items():
        if (off > _OFF).mean() > (FEW if many >= ENOUGH else 0.5) or off.max() > np.log(FAR_OFF):
            wrong = ratios[off > _OFF]
            ways = zip((wrong > 1, (wrong >= 0) & (wrong <= 1), wrong < 0), _WRONG[name], strict=True)
            given = sorted(((int(rows.sum()), way) for rows, way in ways if rows.any()), key=lambda one: -one[0])
            (first, way), *rest = given
            who = f"{first} of {many} " if many > 1 else "it " * (not said)
            those = " and ".join([f"{who}{f'{goes} ' * (not said)}{way}", *(f"{count} {way}" for count, way in rest)])
            said.append("in the last round " * (name == LAST) + those + _in_brackets(beyond, 3))
            strays.append(name.replace(LAST, "size"))
    nearly = "nearly " * any((by > _OFF).any() for _, by, _ in measured.values())
    kept = " and ".join(name for name in measured if name != LAST)
    kept += _in_brackets([f"not the {name} of {one}" for name, (*_, beyond) in measured.items() for one in beyond], 3)
    told = ("; " if many > 1 else " and ").join(said) if said else f"it {nearly}keeps {kept}" * bool(kept)
    return told, [*dict.fromkeys(strays)]


def size_and_pace(*of_runs: Any, of: str = "", apart: str = "", names: Sequence[str] = ()) -> str:
    """Figures of :func:`moves`, ``of`` some, if not all, and how far ``apart`` from recorded states, with its unit."""
    measured, many = _measured(*of_runs, names=names), len(of_runs[0])
    told = ", ".join(f"{name} {_times(ratios, many)}" for name, (ratios, *_) in measured.items())
    counts = {name: (int((by > _OFF).sum()), _in_brackets(who)) for name, (_, by, who) in measured.items()}
    off = ", ".join(f"{name} of {count} of {many}{who}" for name, (count, who) in counts.items() if count)
    which = f"{'' if off else 'none '}beyond {1 / OTHERWISE:.2f} to {OTHERWISE:.2f} times{off and f': {off}'}"
    which = f"; {which}" * (many > 1)
    return f"{of}{told} the demonstrated, typically {apart} from the recorded path{which}" if told else ""


def _measured(*given: Any, names: Sequence[str] = ()) -> dict[str, tuple[Array, Array, list[str]]]:
    """Finite ratios, how far off one they are as printed, as logarithms, and who is beyond, worst first, if not all."""
    found = {}
    for name, values in zip(("size", "pace", LAST), map(np.asarray, given), strict=False):
        runs = np.flatnonzero(np.isfinite(values))
        off = np.abs(np.log(np.maximum(values[runs].round(2), 1e-9)))
        worst = runs[np.argsort(-off, kind="stable")[: (off > _OFF).sum()]]
        found[name] = values[runs], off, [repr(names[run]) for run in worst if len(worst) < len(names)]
    return {name: one for name, one in found.items() if len(one[0])}


def _in_brackets(names: Sequence[str], most: int = 30) -> str:
    return f" ({listed(names, most)})" * bool(names)


def _times(ratios: Array, of: int) -> str:
    """The middle one, and the range of several that differ; of how many, where that is not of all."""
    least, middle, most = (float(one) for one in (ratios.min(), np.median(ratios), ratios.max()))
    ends, said = (_either_way(least), _either_way(most)), _either_way(middle, " times")
    runs, apart = counted(len(ratios), "run"), ends[0] != ends[1]
    return f"{said} ({runs}{f': {ends[0]} to {ends[1]}' * apart})" if apart or len(ratios) < of else said


def _either_way(ratio: float, times: str = "") -> str:
    return f"{abs(ratio):.2f}{times}{' the other way' if ratio < 0 else ''}"


def of_early_end(found: Verdict, why: str) -> Verdict:
    """Add to a verdict on a movement that it stops, for a reason in one sentence, and what to do in another."""
    said, _, then = why.partition(". ")
    doubt = f"{found.doubt} What would have come after."
    return found._replace(mark=no_better(found.mark), said=f"{said}. {found.said}", doubt=doubt.lstrip(), next=then)


PLAIN = {"seam": "jumps to another place", "stale": "values that repeat", "clock-gap": "gaps in time"}
"""Codes of remarks that are no words, in words."""

SAME_CAUSE = ("clock-gap", "seam", "few-demonstrations")
"""What is odd about several demonstrations in one table for no other reason than that."""


def of_surveys(surveys: Sequence[Any], needed: str = "", then: str = "unconstrain fit", apart: str = "") -> Verdict:
    """Judge recordings by what is not as it seems in them, and by what their columns do not tell, a sentence.

    ``then`` is the command for recordings that are as they seem, and where their columns do not tell, a guess; after
    ``apart`` follows the column that tells several demonstrations apart.
    """
    count, few = _count(len(surveys)), len(surveys) < ENOUGH
    fewer = f"{count}: 'fit' tells what was free from {ENOUGH} or more, held in different ways." if few else ""
    warned = [found for found in surveys if {one.code for one in found.warnings} - {"clock-gap", "empty-cells"}]
    odd = {one.code: one for found in reversed(surveys) for one in reversed(found.warnings)}
    kept = [code for code in odd if "several-in-one" not in odd or code not in SAME_CAUSE]
    said = f"{len(warned)} of {count} not as it should be: "
    said += ", ".join(PLAIN.get(code, code.replace("-", " ")) for code in kept) + "."
    if several := odd.get("several-in-one"):
        then = f"Read them one by one, by the column {several.column!r}:\n{apart} {shlex.quote(several.column)}"
        return Verdict(Mark.DOUBTFUL, said, next=then)
    guess = f"{needed} A guess, to be corrected:\n{then}" if needed else then
    if not warned and needed:
        return Verdict(Mark.DOUBTFUL, f"{count}, nothing odd, but fit needs to know more.", doubt=fewer, next=guess)
    if not warned:
        gaps = " but gaps in time, which nothing is smoothed across" * bool(odd)
        rest = " (rest is noted)" * any(one.code == "rest" for found in surveys for one in found.notes)
        said = f"{count}, nothing odd{gaps}: ready to learn from{rest}."
        return Verdict(Mark.DOUBTFUL if few else Mark.GOOD, said, doubt=fewer, next=then)
    cures = "Read the notes below; each names its cure."
    then = f"{cures} And fit needs to know more: {guess}" if needed else f"{cures} Then:\n{then}"
    return Verdict(Mark.DOUBTFUL, said, doubt=fewer, next=then)


_count = partial(counted, noun="demonstration")
