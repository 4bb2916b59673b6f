"""What expressions are called: ARKit's 52 and the visemes, in the spellings that are common."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Literal

Spelling = Literal["keep", "arkit", "underscore", "dot"]
"""Names as they are; 'eyeBlinkLeft' as ARKit has it; 'eyeBlink_L'; 'eyeBlink.L', which Blender's mirror tools know."""

PAIRED = (
    "browDown",
    "browOuterUp",
    "cheekSquint",
    "eyeBlink",
    "eyeLookDown",
    "eyeLookIn",
    "eyeLookOut",
    "eyeLookUp",
    "eyeSquint",
    "eyeWide",
    "mouthDimple",
    "mouthFrown",
    "mouthLowerDown",
    "mouthPress",
    "mouthSmile",
    "mouthStretch",
    "mouthUpperUp",
    "noseSneer",
)
"""Those of ARKit's blend shapes that there are two of, left and right."""

WHOLE = ("browInnerUp", "cheekPuff")
"""One in ARKit, two in many heads."""

MIDDLE = (
    "jawForward",
    "jawLeft",
    "jawOpen",
    "jawRight",
    "mouthClose",
    "mouthFunnel",
    "mouthLeft",
    "mouthPucker",
    "mouthRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "tongueOut",
)

VISEMES = ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "I", "O", "U")
"""Of Oculus' lip sync, as 'viseme_aa' and the like."""

_OTHERS = {
    # faceshift
    "browsd": "browDown",
    "browsu": "browOuterUp",
    "browsuc": "browInnerUp",
    "eyedown": "eyeLookDown",
    "eyein": "eyeLookIn",
    "eyeopen": "eyeWide",
    "eyeout": "eyeLookOut",
    "eyeup": "eyeLookUp",
    "jawfwd": "jawForward",
    # VRM, and what people type
    "blink": "eyeBlink",
    "eyeclose": "eyeBlink",
    "eyeclosed": "eyeBlink",
    # Character Creator
    "browdrop": "browDown",
    "browraiseinner": "browInnerUp",
    "browraiseouter": "browOuterUp",
    "mouthrollinlower": "mouthRollLower",
    "mouthrollinupper": "mouthRollUpper",
    # Unified Expressions
    "browlowerer": "browDown",
    "lipfunnel": "mouthFunnel",
    "lippucker": "mouthPucker",
    "lipsucklower": "mouthRollLower",
    "lipsuckupper": "mouthRollUpper",
    "mouthclosed": "mouthClose",
    "mouthraiserlower": "mouthShrugLower",
    "mouthraiserupper": "mouthShrugUpper",
    # visemes: VRChat's and Character Creator's
    "visemeih": "viseme_I",
    "visemeoh": "viseme_O",
    "visemeou": "viseme_U",
    "bmp": "viseme_PP",
    "fv": "viseme_FF",
    "tldn": "viseme_DD",
    "kghng": "viseme_kk",
    "chj": "viseme_CH",
    "sz": "viseme_SS",
}
_KNOWN = {base.lower(): base for base in (*PAIRED, *WHOLE, *MIDDLE)}
_KNOWN |= {f"viseme{sound.lower()}": f"viseme_{sound}" for sound in VISEMES} | _OTHERS
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_SIDES = {"l": "L", "left": "L", "r": "R", "right": "R"}
_PREFIX = re.compile(r"^(?:blendshapes?\d*|morpher|head|face|vrc)[.:_ ](?=.)", re.IGNORECASE)


def understood(name: str) -> tuple[str, str] | None:
    """Return the expression of a name and its side: 'L', 'R' or ''; None if it is none of the known ones.

    >>> understood("Eye_Blink_L"), understood("blendShape2.mouthSmileRight"), understood("jawLeft")
    (('eyeBlink', 'L'), ('mouthSmile', 'R'), ('jawLeft', ''))
    >>> understood("vrc.v_ou"), understood("browInnerUp_R"), understood("Nose Wobble")
    (('viseme_U', ''), ('browInnerUp', 'R'), None)
    """
    words = [word.lower() for word in _WORD.findall(_PREFIX.sub("", name))]
    if words[:1] == ["v"]:
        words[0] = "viseme"
    base = _KNOWN.get("".join(words))
    if base is not None:
        return None if base in PAIRED else (base, "")
    sides = [k for k, word in enumerate(words) if word in _SIDES]
    if len(sides) != 1:
        return None
    base = _KNOWN.get("".join(words[: sides[0]] + words[sides[0] + 1 :]))
    return (base, _SIDES[words[sides[0]]]) if base in PAIRED or base in WHOLE else None


def spelled(base: str, side: str, spelling: Spelling) -> str:
    """Return the name of an expression.

    >>> [spelled("eyeBlink", "L", way) for way in ("arkit", "underscore", "dot")]
    ['eyeBlinkLeft', 'eyeBlink_L', 'eyeBlink.L']
    """
    if not side:
        return base
    return base + {"arkit": {"L": "Left", "R": "Right"}[side], "underscore": f"_{side}", "dot": f".{side}"}[spelling]


def renamed(
    names: Iterable[str], spelling: Spelling, flipped: Callable[[str], str] | None = None, *, join: bool = True
) -> dict[str, tuple[str, ...]]:
    """Return the names that expressions get, each with those of the source that it is the sum of.

    Parameters
    ----------
    names : iterable of str
    spelling : str
        Unknown names stay. In ARKit's spelling halves that it does not have are one: 'browInnerUp_L' and
        'browInnerUp_R' are 'browInnerUp'.
    flipped : callable, optional
        Given where the map mirrors: it returns a name with left and right exchanged.
    join : bool
        Whether halves become one at all.

    Examples
    --------
    >>> renamed(["Jaw_Open", "cheekPuff_L", "cheekPuff_R", "Wink"], "arkit")
    {'jawOpen': ('Jaw_Open',), 'cheekPuff': ('cheekPuff_L', 'cheekPuff_R'), 'Wink': ('Wink',)}
    """
    names = list(names)
    known = {name: understood(name) for name in names} if spelling != "keep" else dict.fromkeys(names)
    sides: dict[str, set[str]] = {}
    for meaning in known.values():
        if meaning is not None:
            sides.setdefault(meaning[0], set()).add(meaning[1])
    result: dict[str, tuple[str, ...]] = {}
    for name, meaning in known.items():
        new = name if flipped is None else flipped(name)
        if meaning is not None:
            base, side = meaning
            if join and spelling == "arkit" and base in WHOLE and sides[base] == {"L", "R"}:
                result[base] = (*result.get(base, ()), name)
                continue
            if flipped is not None:
                side = {"L": "R", "R": "L", "": ""}[side]
                base = base if side else flipped(base)
            new = spelled(base, side, spelling)
            if new in result or (new in known and known[new] is None):
                new = name if flipped is None else flipped(name)
        while new in result:  # two of the source's keys mean the same
            new = name if name not in result else f"{new}.001"
        result[new] = (name,)
    return result
