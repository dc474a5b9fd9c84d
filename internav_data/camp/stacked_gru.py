"""GRUs of one size side by side: one loop over steps for all of them, on a CPU.

Small GRUs spend their time between products. Here the matrices of k GRUs are stacked, so that a
step is one batched product, and the gradient of the recurrent weights is a single product over all
steps instead of one a step. Shapes: T steps, k GRUs, n environments, h units.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.autograd.function import BackwardCFunction, FunctionCtx, once_differentiable
from torch.nn import functional


def run_stacked(
    grus: Sequence[nn.GRU], inputs: Sequence[Tensor], hidden: Tensor, episode_starts: Tensor
) -> Tensor:
    """Run GRUs of one layer and of equal numbers of units.

    Parameters
    ----------
    grus
        The k GRUs; their numbers of inputs may differ.
    inputs
        Inputs of each, (T, n, inputs).
    hidden : (k, n, h)
        Hidden states before the first step.
    episode_starts : (T, n) bool
        Steps before which hidden states are zeroed.

    Returns
    -------
    (T, k, n, h): outputs, which are the hidden states after each step
    """
    of_inputs, weights, input_biases, biases = zip(*(g.all_weights[0] for g in grus), strict=True)
    projected = map(functional.linear, inputs, of_inputs, input_biases)  # (T, n, 3 h) each
    kept = (~episode_starts).to(hidden.dtype).unsqueeze(-1)  # (T, n, 1)
    outputs: Tensor = _StackedGRU.apply(  # type: ignore[no-untyped-call]
        torch.stack([*projected], 1),
        torch.stack(weights),  # (k, 3 h, h)
        torch.stack(biases).unsqueeze(1),  # (k, 1, 3 h)
        hidden,
        kept,
    )
    return outputs


class _StackedGRU(torch.autograd.Function):
    """Recurrence of PyTorch's GRU; gates are in its order: reset r, update z, candidate c.

    With g the projected inputs and u = W h + b, r and z are the sigmoids of g + u,
    c = tanh(g + r u), and the new state is (1 - z) c + z h.
    """

    @staticmethod
    def forward(
        ctx: FunctionCtx,
        projected: Tensor,
        weights: Tensor,
        biases: Tensor,
        hidden: Tensor,
        kept: Tensor,
    ) -> Tensor:
        units = hidden.shape[-1]
        outputs = projected.new_empty(*projected.shape[:-1], units)
        before, candidates, recurrent = (torch.empty_like(outputs) for _ in range(3))
        gates = projected.new_empty(*projected.shape[:-1], 2 * units)
        transposed = weights.transpose(1, 2)
        for t, inputs in enumerate(projected):
            torch.mul(hidden, kept[t], out=before[t])
            products = torch.baddbmm(biases, before[t], transposed)
            torch.add(inputs[..., : 2 * units], products[..., : 2 * units], out=gates[t]).sigmoid_()
            recurrent[t] = products[..., 2 * units :]
            reset, update = gates[t].chunk(2, -1)
            torch.addcmul(inputs[..., 2 * units :], reset, recurrent[t], out=candidates[t]).tanh_()
            hidden = torch.lerp(candidates[t], before[t], update, out=outputs[t])
        ctx.save_for_backward(weights, before, candidates, recurrent, gates, kept)
        return outputs

    @staticmethod
    @once_differentiable
    def backward(ctx: BackwardCFunction, gradient: Tensor) -> tuple[Tensor | None, ...]:
        weights, before, candidates, recurrent, gates, kept = tuple(ctx.saved_tensors)
        units = before.shape[-1]
        reset, update = gates.chunk(2, -1)
        # Derivatives of a step's output by what its gates and its candidate are functions of.
        by_candidate = (1.0 - update) * (1.0 - candidates.square())
        by_update = (before - candidates) * update * (1.0 - update)
        by_reset = recurrent * reset * (1.0 - reset)
        of_inputs = gates.new_empty(*gates.shape[:-1], 3 * units)
        of_products = torch.empty_like(of_inputs)
        of_hidden = torch.zeros_like(before[0])
        for t in reversed(range(len(before))):
            of_output = of_hidden + gradient[t]
            row = of_products[t]
            of_candidate = torch.mul(of_output, by_candidate[t], out=of_inputs[t, ..., 2 * units :])
            torch.mul(of_candidate, by_reset[t], out=row[..., :units])
            torch.mul(of_output, by_update[t], out=row[..., units : 2 * units])
            torch.mul(of_candidate, reset[t], out=row[..., 2 * units :])
            of_hidden = torch.baddbmm(of_output * update[t], row, weights) * kept[t]
        of_inputs[..., : 2 * units] = of_products[..., : 2 * units]
        rows = of_products.transpose(0, 1).flatten(1, 2)  # (k, T n, 3 h)
        states = before.transpose(0, 1).flatten(1, 2)  # (k, T n, h)
        of_weights = torch.bmm(rows.transpose(1, 2), states)
        return of_inputs, of_weights, rows.sum(1, keepdim=True), of_hidden, None
