"""With jax: the push that makes a block slide to a mark and stop there, by `jax.custom_vjp`."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from carom import gradient, planar

Floats = npt.NDArray[np.float64]
MARK = 1.5  # where the block is to stop [m]
STEPS = 20


def scene() -> planar.World:
    """A block on a floor."""
    w = planar.World(dt=0.1, scheme="events")
    w.add_static("floor", planar.HalfPlane(), friction=0.4)
    w.add_body("block", planar.Box(0.4, 0.2), density=20.0, friction=0.4, position=(0, 0.1))
    return w


def roll(velocity: Floats) -> gradient.Rollout:
    """Steps from an initial velocity (2,) of the block [m/s]."""
    return gradient.record(scene(), STEPS, initial={"velocity": np.array([[0.0, 0.0], velocity])})


def forward(velocity: Floats) -> Floats:
    """Where the block ends (2,) [m]."""
    return np.array(roll(np.asarray(velocity)).position[-1, 1])


def backward(velocity: Floats, cotangent: Floats) -> Floats:
    """The vector-Jacobian product: what a cotangent of the end says of the velocity."""
    seed = np.array([[0.0, 0.0], np.asarray(cotangent)])
    found: Floats = roll(np.asarray(velocity)).pullback({"position": seed}, at=-1)["velocity"][1]
    return found


def main() -> None:
    """Descends along jax's gradient until the block stops at the mark."""
    try:
        import jax
    except ImportError:
        print("this example needs jax: pip install jax")
        return
    jax.config.update("jax_enable_x64", True)
    two = jax.ShapeDtypeStruct((2,), np.float64)

    @jax.custom_vjp
    def end_of(velocity: jax.Array) -> jax.Array:
        return jax.pure_callback(forward, two, velocity)

    end_of.defvjp(
        lambda velocity: (end_of(velocity), velocity),
        lambda velocity, cotangent: (jax.pure_callback(backward, two, velocity, cotangent),),
    )

    def loss(speed: jax.Array) -> jax.Array:
        end = end_of(jax.numpy.array([1.0, 0.0]) * speed)
        return (end[0] - MARK) ** 2

    speed = jax.numpy.float64(2.0)
    for _ in range(60):
        speed = speed - 0.3 * jax.grad(loss)(speed)
    exact = np.sqrt(2 * 0.4 * 9.81 * MARK)
    print(f"push with {float(speed):.9f} m/s; the closed form says {exact:.9f} m/s")
    assert abs(float(speed) - exact) < 1e-6


if __name__ == "__main__":
    main()
