//! SegNet (Badrinarayanan, Kendall and Cipolla, IEEE PAMI 39, 2017): an encoder halves the grid step by step and keeps where each
//! maximum was, a decoder puts the values back to these places.

use crate::layers::{Maker, normalised};
use burn::module::{Module, Param, RunningState};
use burn::tensor::activation::relu;
use burn::tensor::module::{conv2d, max_pool2d_with_indices};
use burn::tensor::ops::{ConvOptions, MaxPoolOptions, PadMode};
use burn::tensor::{Device, IndexingUpdateOp, Int, Tensor};

/// How large a network is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Number of encoders, and of decoders.
    pub layers: usize,
    /// Channels between them.
    pub channels: usize,
    /// Width of the square kernels, cells; odd.
    pub kernel: usize,
    /// Planes of the input.
    pub planes: usize,
    /// Number of classes.
    pub classes: usize,
}

/// A convolution that keeps the grid's size, and batch normalisation.
#[derive(Module, Debug)]
pub(crate) struct Block {
    /// `[out, in, row, column]`.
    weight: Param<Tensor<4>>,
    gamma: Param<Tensor<1>>,
    beta: Param<Tensor<1>>,
    mean: RunningState<Tensor<1>>,
    variance: RunningState<Tensor<1>>,
}

/// The network.
#[derive(Module, Debug)]
pub struct SegNet {
    encoders: Vec<Block>,
    decoders: Vec<Block>,
    /// `[class, channel, 1, 1]`.
    classify: Param<Tensor<4>>,
    bias: Param<Tensor<1>>,
}

impl Block {
    pub(crate) fn new(make: &mut Maker<'_>, input: usize, output: usize, kernel: usize) -> Block {
        let weight = make.kernel([output, input, kernel, kernel]);
        let (gamma, beta) = (make.ones(output), make.zeros(output));
        let [mean, variance] = make.running(output);
        Block { weight, gamma, beta, mean, variance }
    }

    pub(crate) fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let half = self.weight.dims()[2] / 2;
        let x = conv2d(x, self.weight.val(), None, ConvOptions::new([1, 1], [half, half], [1, 1], 1));
        normalised(x, &self.gamma, &self.beta, &self.mean, &self.variance)
    }
}

/// Puts each value to the place in its grid that `indices` (row · columns + column) names; all other cells are 0. Values
/// `[picture, channel, row, column]` become `[picture, channel, size[0], size[1]]`.
pub fn unpool(x: Tensor<4>, indices: Tensor<4, Int>, size: [usize; 2]) -> Tensor<4> {
    let [pictures, channels, rows, columns] = x.dims();
    let flat = [pictures, channels, rows * columns];
    let empty = Tensor::<3>::zeros([pictures, channels, size[0] * size[1]], &x.device());
    empty
        .scatter(2, indices.reshape(flat), x.reshape(flat), IndexingUpdateOp::Add)
        .reshape([pictures, channels, size[0], size[1]])
}

/// What the encoders of a network keep of a picture.
pub(crate) struct Encoded {
    /// `[picture, channel, row, column]`, as often halved as there are encoders.
    pub(crate) values: Tensor<4>,
    /// Of each encoder where its maxima were, and the size of the grid that it halved.
    places: Vec<(Tensor<4, Int>, [usize; 2])>,
}

/// The encoders of a network for pictures of so many planes.
pub(crate) fn encoders(make: &mut Maker<'_>, shape: &Shape) -> Vec<Block> {
    let input = |layer: usize| if layer == 0 { shape.planes } else { shape.channels };
    (0..shape.layers).map(|k| Block::new(make, input(k), shape.channels, shape.kernel)).collect()
}

/// Pictures `[picture, plane, row, column]` of any size behind the encoders. Where the sides are no multiples of 2 to the number of
/// encoders, empty cells are added at the far and the right side.
pub(crate) fn encoded(encoders: &[Block], x: Tensor<4>) -> Encoded {
    let [_, _, rows, columns] = x.dims();
    let step = 1 << encoders.len();
    let wanted = [rows.next_multiple_of(step), columns.next_multiple_of(step)];
    let mut values = match wanted == [rows, columns] {
        true => x,
        false => x.pad((0, wanted[1] - columns, 0, wanted[0] - rows), PadMode::Constant(0.0)),
    };
    let mut places = Vec::new();
    for encoder in encoders {
        let full = relu(encoder.forward(values));
        let [_, _, r, c] = full.dims();
        let (pooled, indices) =
            max_pool2d_with_indices(full, MaxPoolOptions::new([2, 2]).with_stride([2, 2]));
        places.push((indices, [r, c]));
        values = pooled;
    }
    Encoded { values, places }
}

impl SegNet {
    /// A network whose weights follow from the seed.
    pub fn new(shape: Shape, seed: u32, device: &Device) -> SegNet {
        let mut make = Maker::new(seed, device);
        let Shape { layers, channels, kernel, classes, .. } = shape;
        SegNet {
            encoders: encoders(&mut make, &shape),
            decoders: (0..layers).map(|_| Block::new(&mut make, channels, channels, kernel)).collect(),
            classify: make.kernel([classes, channels, 1, 1]),
            bias: make.zeros(classes),
        }
    }

    /// Scores of the classes, `[picture, class, row, column]`, of grids `[picture, plane, row, column]` of any size. Where the sides
    /// are no multiples of 2 to the number of layers, empty cells are added at the far and the right side and cut off again.
    ///
    /// On a device with gradients batches are normalised by their own mean and variance, else by the running ones.
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let [pictures, _, rows, columns] = x.dims();
        let Encoded { values: mut x, places } = encoded(&self.encoders, x);
        for (decoder, (indices, size)) in self.decoders.iter().zip(places.into_iter().rev()) {
            x = decoder.forward(unpool(x, indices, size));
        }
        let plain = ConvOptions::new([1, 1], [0, 0], [1, 1], 1);
        let x = conv2d(x, self.classify.val(), Some(self.bias.val()), plain);
        let classes = x.dims()[1];
        x.slice([0..pictures, 0..classes, 0..rows, 0..columns])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One picture of 4 x 4 cells, by hand.
    #[test]
    fn unpooling_by_hand() {
        let device = Device::flex();
        let x = Tensor::<4>::from_data(
            [[[[1.0, 9.0, 2.0, 0.0], [3.0, 4.0, 8.0, 5.0], [0.5, 0.0, 1.0, 1.5], [0.25, 7.0, 6.0, 0.0]]]],
            &device,
        );
        let (pooled, indices) = max_pool2d_with_indices(x, MaxPoolOptions::new([2, 2]).with_stride([2, 2]));
        assert_eq!(pooled.to_data().try_to_vec::<f32>().unwrap(), [9.0, 8.0, 7.0, 6.0]);
        let back = unpool(pooled, indices, [4, 4]).to_data().try_to_vec::<f32>().unwrap();
        let mut expected = [0.0f32; 16];
        (expected[1], expected[6], expected[13], expected[14]) = (9.0, 8.0, 7.0, 6.0);
        assert_eq!(back, expected);
    }

    /// The gradient of an unpooled value is that of the cell to which it went.
    #[test]
    fn unpooling_hands_gradients_back() {
        let device = Device::flex().autodiff();
        let x = Tensor::<4>::from_data([[[[2.0, 3.0]]]], &device).require_grad();
        let indices = Tensor::<4, Int>::from_data([[[[1, 2]]]], &device);
        let weights = Tensor::<4>::from_data([[[[10.0, 20.0, 30.0, 40.0], [0.0, 0.0, 0.0, 0.0]]]], &device);
        let sum = (unpool(x.clone(), indices, [2, 4]) * weights).sum();
        let grads = sum.backward();
        assert_eq!(x.grad(&grads).unwrap().to_data().try_to_vec::<f32>().unwrap(), [20.0, 30.0]);
    }

    #[test]
    fn grids_of_any_size_keep_it() {
        let device = Device::flex();
        for (layers, rows, columns) in [(1, 5, 3), (3, 17, 21), (6, 70, 65), (2, 8, 8)] {
            let shape = Shape { layers, channels: 3, kernel: 3, planes: 2, classes: 4 };
            let net = SegNet::new(shape, 1, &device);
            let out = net.forward(Tensor::ones([2, 2, rows, columns], &device));
            assert_eq!(out.dims(), [2, 4, rows, columns]);
            let values = out.to_data().try_to_vec::<f32>().unwrap();
            assert!(values.iter().all(|v| v.is_finite()));
        }
    }

    #[test]
    fn weights_follow_from_the_seed() {
        let bytes = |seed| {
            let shape = Shape { layers: 2, channels: 4, kernel: 3, planes: 1, classes: 2 };
            SegNet::new(shape, seed, &Device::flex()).into_record().into_bytes().unwrap().to_vec()
        };
        assert_eq!(bytes(7), bytes(7));
        assert_ne!(bytes(7), bytes(8));
    }
}
