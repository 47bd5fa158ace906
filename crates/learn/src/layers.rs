//! What all networks are built from: parameters whose first values follow from the seed, and batch normalisation.

use burn::module::{Module, Param, ParamId, RunningState};
use burn::tensor::activation::relu;
use burn::tensor::module::{batch_norm, batch_norm_train};
use burn::tensor::{Device, Tensor, TensorData};
use catseye::base::rng::Draws;

/// Added to a variance before its root is taken.
const EPSILON: f64 = 1e-5;
/// Share of the newest batch in the running mean and variance.
const MOMENTUM: f64 = 0.1;

/// Makes parameters one after the other: their identities are their numbers, and their first values follow from seed and number alone.
pub(crate) struct Maker<'a> {
    seed: u32,
    next: u32,
    device: &'a Device,
}

impl Maker<'_> {
    pub(crate) fn new(seed: u32, device: &Device) -> Maker<'_> {
        Maker { seed, next: 0, device }
    }

    pub(crate) fn id(&mut self) -> ParamId {
        self.next += 1;
        ParamId::from(u64::from(self.next))
    }

    pub(crate) fn param<const D: usize>(&mut self, tensor: Tensor<D>) -> Param<Tensor<D>> {
        let tensor = if self.device.is_autodiff() { tensor.require_grad() } else { tensor };
        Param::initialized(self.id(), tensor)
    }

    /// Weights whose first axis is that of the outputs, uniform within ±√(6/n) for n inputs of a value (He et al., ICCV 2015).
    pub(crate) fn kernel<const D: usize>(&mut self, shape: [usize; D]) -> Param<Tensor<D>> {
        let bound = (6.0 / shape[1..].iter().product::<usize>() as f64).sqrt();
        let mut draws = Draws::new(self.seed, self.next);
        let count = shape.iter().product();
        let values: Vec<f32> = (0..count).map(|_| (bound * (2.0 * draws.uniform() - 1.0)) as f32).collect();
        let tensor = Tensor::from_data(TensorData::new(values, shape), self.device);
        self.param(tensor)
    }

    pub(crate) fn zeros(&mut self, width: usize) -> Param<Tensor<1>> {
        self.param(Tensor::zeros([width], self.device))
    }

    pub(crate) fn ones(&mut self, width: usize) -> Param<Tensor<1>> {
        self.param(Tensor::ones([width], self.device))
    }

    /// The running mean and variance of so many channels.
    pub(crate) fn running(&mut self, width: usize) -> [RunningState<Tensor<1>>; 2] {
        let (zeros, ones) = (Tensor::zeros([width], self.device), Tensor::ones([width], self.device));
        [RunningState::with_id(self.id(), zeros), RunningState::with_id(self.id(), ones)]
    }

    fn norm(&mut self, width: usize) -> Norm {
        let (gamma, beta) = (self.ones(width), self.zeros(width));
        let [mean, variance] = self.running(width);
        Norm { gamma, beta, mean, variance }
    }

    fn dense(&mut self, input: usize, output: usize) -> Dense {
        Dense { weight: self.kernel([output, input]), norm: self.norm(output) }
    }

    /// Perceptrons one behind the other, of these widths.
    pub(crate) fn stack(&mut self, widths: &[usize]) -> Vec<Dense> {
        widths.windows(2).map(|w| self.dense(w[0], w[1])).collect()
    }

    pub(crate) fn input(&mut self, width: usize) -> Norm {
        self.norm(width)
    }
}

/// Normalises channels, the second axis: on a device with gradients by mean and variance of the batch, which go into the running ones,
/// else by the running ones.
pub(crate) fn normalised<const D: usize>(
    x: Tensor<D>,
    gamma: &Param<Tensor<1>>,
    beta: &Param<Tensor<1>>,
    mean: &RunningState<Tensor<1>>,
    variance: &RunningState<Tensor<1>>,
) -> Tensor<D> {
    if !x.device().is_autodiff() {
        return batch_norm(x, gamma.val(), beta.val(), mean.value(), variance.value(), EPSILON);
    }
    let normal = batch_norm_train(x, gamma.val(), beta.val(), EPSILON);
    for (state, new) in [(mean, normal.mean), (variance, normal.variance)] {
        let old = state.value_sync().mul_scalar(1.0 - MOMENTUM);
        state.update(old.add(new.detach().mul_scalar(MOMENTUM)).detach());
    }
    normal.output
}

/// Batch normalisation of rows `[row, channel]`.
#[derive(Module, Debug)]
pub(crate) struct Norm {
    gamma: Param<Tensor<1>>,
    beta: Param<Tensor<1>>,
    mean: RunningState<Tensor<1>>,
    variance: RunningState<Tensor<1>>,
}

impl Norm {
    pub(crate) fn forward(&self, x: Tensor<2>) -> Tensor<2> {
        normalised(x, &self.gamma, &self.beta, &self.mean, &self.variance)
    }
}

/// One perceptron for every row: weights, batch normalisation and ReLU.
#[derive(Module, Debug)]
pub(crate) struct Dense {
    /// `[out, in]`.
    weight: Param<Tensor<2>>,
    norm: Norm,
}

impl Dense {
    fn forward(&self, x: Tensor<2>) -> Tensor<2> {
        relu(self.norm.forward(x.matmul(self.weight.val().transpose())))
    }
}

/// The rows behind perceptrons that follow each other.
pub(crate) fn through(stack: &[Dense], x: Tensor<2>) -> Tensor<2> {
    stack.iter().fold(x, |x, layer| layer.forward(x))
}
