"""With torch: the throw that brings a ball to a place after a bounce, by `torch.autograd.Function`."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from carom import gradient, planar

Floats = npt.NDArray[np.float64]
TARGET = np.array([1.6, 0.7])  # where the ball is to be [m]
STEPS = 9  # of a tenth of a second


def scene() -> planar.World:
    """A ball above a floor that it bounces off."""
    w = planar.World(dt=0.1, scheme="events")
    w.add_static("floor", planar.HalfPlane(), friction=0.3)
    w.add_body("ball", planar.Circle(0.1), density=50.0, friction=0.3, restitution=0.8, position=(0, 1))
    return w


def roll(velocity: Floats) -> gradient.Rollout:
    """Steps from an initial velocity (2,) of the ball [m/s]."""
    return gradient.record(scene(), STEPS, initial={"velocity": np.array([[0.0, 0.0], velocity])})


def forward(velocity: Floats) -> tuple[Floats, gradient.Rollout]:
    """Where the ball ends (2,) [m], and what the way back needs."""
    rollout = roll(velocity)
    return np.array(rollout.position[-1, 1]), rollout


def backward(rollout: gradient.Rollout, cotangent: Floats) -> Floats:
    """The vector-Jacobian product: what a cotangent of the end says of the velocity."""
    found: Floats = rollout.pullback({"position": np.array([[0.0, 0.0], cotangent])}, at=-1)["velocity"][1]
    return found


def main() -> None:
    """Lets torch's optimiser find the throw."""
    try:
        import torch
    except ImportError:
        print("this example needs torch: pip install torch")
        return

    class EndOf(torch.autograd.Function):
        @staticmethod
        def forward(ctx: Any, velocity: torch.Tensor) -> torch.Tensor:
            end, ctx.rollout = forward(velocity.detach().numpy())
            return torch.from_numpy(end)

        @staticmethod
        def backward(ctx: Any, cotangent: torch.Tensor) -> torch.Tensor:
            return torch.from_numpy(backward(ctx.rollout, cotangent.numpy()))

    velocity = torch.tensor([1.0, -1.0], dtype=torch.float64, requires_grad=True)
    optimiser = torch.optim.LBFGS(
        [velocity], max_iter=100, tolerance_grad=1e-12, tolerance_change=0, line_search_fn="strong_wolfe"
    )

    def closure() -> torch.Tensor:
        optimiser.zero_grad()
        loss = ((EndOf.apply(velocity) - torch.from_numpy(TARGET)) ** 2).sum()
        loss.backward()
        return loss

    optimiser.step(closure)
    end, rollout = forward(velocity.detach().numpy())
    print(f"throw with {velocity.detach().numpy()} m/s; the ball comes to {end} m; flags: {rollout.flags}")
    assert np.abs(end - TARGET).max() < 1e-6


if __name__ == "__main__":
    main()
