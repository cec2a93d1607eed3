"""What representation wrappers put on by hand do to actions and observations."""

from __future__ import annotations

from typing import Any, ClassVar, TypeVar

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from clarke_gym.envs.face import Face
from clarke_gym.envs.observer import Block
from clarke_gym.representations import Representation, make_representation


def face_of(env: Any, wrapper: str) -> Face:
    """Return one of our environments under any wrappers, or say that it is none.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
    wrapper : str
        Who asks.

    Returns
    -------
    Face

    Raises
    ------
    TypeError
        If it is another environment.

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> face_of(gymnasium.make("clarke_gym/Reach-v0"), "ClarkeAction").robot.n_joints
    3
    """
    face = env.unwrapped
    if not isinstance(face, Face):
        raise TypeError(f"{wrapper} needs a clarke_gym environment, got {env!r}")
    return face


def codec_of(env: Any, kind: type[C]) -> C | None:
    """Return what a wrapper put on by hand does, None without one.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
    kind : type
        `ActionCodec` or `ObservationCodec`.

    Returns
    -------
    ActionCodec, ObservationCodec or None

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> from clarke_gym.wrappers import ClarkeAction
    >>> env = gymnasium.make("clarke_gym/Reach-v0")
    >>> codec_of(env, ActionCodec), codec_of(ClarkeAction(env), ActionCodec).representation.name
    (None, 'clarke')
    """
    layer = env
    while layer is not layer.unwrapped:
        codec = vars(layer).get("_codec")
        if isinstance(codec, kind):
            return codec
        layer = layer.env
    return None


def representation_of(env: Any, kind: type[Codec]) -> Representation:
    """Return the representation of a wrapper put on by hand, or the environment's own.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
    kind : type
        `ActionCodec` or `ObservationCodec`.

    Returns
    -------
    Representation

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> from clarke_gym.wrappers import ClarkeAction
    >>> env = ClarkeAction(gymnasium.make("clarke_gym/Reach-v0"))
    >>> [representation_of(env, kind).name for kind in (ActionCodec, ObservationCodec)]
    ['clarke', 'raw']
    """
    codec = codec_of(env, kind)
    if codec is not None:
        return codec.representation
    own: Representation = getattr(env.unwrapped, f"{kind.of}_representation")
    return own


def place_of(env: Any, block: Block) -> slice:
    """Return where a sensor stands in an observation, a wrapper put on by hand counted in.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
    block : Block
        Of the environment's `sensors`.

    Returns
    -------
    slice

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> from clarke_gym.wrappers import ClarkeObservation
    >>> env = gymnasium.make("clarke_gym/Reach-v0", n_tendons=7)
    >>> block = env.unwrapped.sensors["tip_position"]
    >>> place_of(env, block), place_of(ClarkeObservation(env), block)
    (slice(14, 17, None), slice(4, 7, None))
    """
    codec = codec_of(env, ObservationCodec)
    return block.place if codec is None else codec.place(block)


def same_numbers(space: Any, own: Any) -> bool:
    """Return whether a space holds what another does: bounds may be lifted, and no more.

    Parameters
    ----------
    space, own : gymnasium.Space

    Returns
    -------
    bool

    Examples
    --------
    >>> own = spaces.Box(-1.0, 1.0, (2,))
    >>> [same_numbers(spaces.Box(-high, high, (2,)), own) for high in (np.inf, 2.0)]
    [True, False]
    """
    if not (isinstance(space, spaces.Box) and isinstance(own, spaces.Box)):
        return bool(space == own)
    bounds = ((space.low, own.low), (space.high, own.high))
    return space.shape == own.shape and all(bool(((a == b) | np.isinf(a)).all()) for a, b in bounds)


def _short(space: Any) -> str:
    """Return what a message says of a space."""
    if not isinstance(space, spaces.Box):
        return repr(space)
    return f"{space.shape} from {space.low.min():g} to {space.high.max():g}"


class Codec:
    """Writes one kind of joint-space numbers in a representation.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        A clarke_gym environment whose numbers of this kind are in joint space.
    name : str
        The representation.
    wrapper : str
        Who asks.

    Raises
    ------
    TypeError, ValueError
        If it is another environment, or its numbers are not in joint space any more.
    """

    of: ClassVar[str]
    """The kind, "action" or "observation"."""

    def __init__(self, env: Any, name: str, wrapper: str) -> None:
        face = face_of(env, wrapper)
        needs = f"{wrapper} needs {self.of}s in joint space; "
        own: Representation = getattr(face, f"{self.of}_representation")
        if own.name != "raw":
            raise ValueError(
                f"{needs}this environment was made with "
                f"{self.of}_representation={own.name!r} already"
            )
        below = codec_of(env, type(self))
        if below is not None:
            raise ValueError(
                f"{needs}a wrapper below writes them as {below.representation.name!r} already"
            )
        self._refuse_changed(env, wrapper)
        self.representation: Representation = make_representation(name, face.robot)

    def _refuse_changed(self, env: Any, wrapper: str) -> None:
        """Refuse what wrappers below have written in other numbers than the environment's."""
        single = f"single_{self.of}_space"
        name = single if hasattr(env, single) else f"{self.of}_space"
        space, own = getattr(env, name), getattr(env.unwrapped, name)
        if isinstance(own, spaces.Dict):
            space, own = (getattr(each, "spaces", {}).get("observation") for each in (space, own))
        if not same_numbers(space, own):
            raise ValueError(
                f"{wrapper} needs {self.of}s as the environment has them, {_short(own)}; a wrapper "
                f"below makes them {_short(space)}: put {wrapper} on first"
            )


C = TypeVar("C", bound=Codec)


class ActionCodec(Codec):
    """Turns actions in a representation into joint-space actions; takes what `Codec` does."""

    of: ClassVar[str] = "action"

    def __init__(self, env: Any, name: str, wrapper: str) -> None:
        super().__init__(env, name, wrapper)
        self.space = spaces.Box(-1.0, 1.0, (self.representation.size,), np.float32)

    def decode(self, action: ArrayLike) -> NDArray[np.float64]:
        """Return joint-space actions in double precision, on the manifold to rounding."""
        return self.representation.decode(np.asarray(action, dtype=np.float64))


class ObservationCodec(Codec):
    """Turns joint-space blocks of observations into a representation; takes what `Codec` does."""

    of: ClassVar[str] = "observation"

    def __init__(self, env: Any, name: str, wrapper: str) -> None:
        super().__init__(env, name, wrapper)
        face = face_of(env, wrapper)
        self._joints = face.robot.n_joints
        reaches = [block.reach for block in face.sensors.values() if block.reach is not None]
        self._count, self._width = len(reaches), len(reaches) * self._joints
        bounds = [self.representation.encoded_bound(face.robot, *reach) for reach in reaches]
        # The margin covers float32 rounding of the encoding.
        self._high = np.concatenate([[], *((1.0 + 1e-6) * b for b in bounds)]).astype(np.float32)

    def space(self, inner: spaces.Space[Any]) -> spaces.Space[Any]:
        """Return the space of one environment's encoded observations."""
        if isinstance(inner, spaces.Dict):
            box = self.space(inner["observation"])
            return spaces.Dict({**inner.spaces, "observation": box})
        assert isinstance(inner, spaces.Box)
        high = np.concatenate([self._high, inner.high[self._width :]])
        return spaces.Box(-high, high, dtype=np.float32)

    def place(self, block: Block) -> slice:
        """Return where a sensor stands in encoded observations."""
        size, start, stop = self.representation.size, block.place.start, block.place.stop
        if block.reach is None:
            wider = self._count * size - self._width
            return slice(start + wider, stop + wider)
        start = start // self._joints * size
        return slice(start, start + size)

    def encode(self, observation: Any) -> Any:
        """Return observations with their joint-space blocks encoded, as new arrays."""
        if isinstance(observation, dict):
            return {**observation, "observation": self.encode(observation["observation"])}
        lead = observation.shape[:-1]
        blocks = observation[..., : self._width].astype(np.float64)
        blocks = blocks.reshape(*lead, self._count, self._joints)
        coded = self.representation.encode(blocks).reshape(*lead, len(self._high))
        coded = np.clip(coded, -self._high, self._high)
        tail = observation[..., self._width :]
        return np.concatenate([coded, tail], axis=-1).astype(np.float32)
