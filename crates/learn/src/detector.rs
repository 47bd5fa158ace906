//! A network that predicts contours of objects in one stage, in the manner of YOLO (Redmon and Farhadi 2018) with irregular quadrilaterals
//! (Feng 2019, section 5.2.8): the encoders of a SegNet, one more convolution, and in each cell of the coarse grid that remains, for
//! each class, a confidence and eight numbers.

use crate::layers::Maker;
use crate::segnet::{Block, Shape, encoded, encoders};
use burn::module::{Module, Param};
use burn::tensor::activation::relu;
use burn::tensor::module::conv2d;
use burn::tensor::ops::ConvOptions;
use burn::tensor::{Device, Tensor, TensorData};

/// Numbers of a prediction: the logarithm of the odds that an object is there, and x and y of each corner.
pub const NUMBERS: usize = 9;

/// What an untrained network says of every cell: odds of 1 : 50, which keeps the many empty cells from all the first steps, and corners
/// (x, y) one unit near and far, left and right, in the order that [`Quad`](crate::quad::Quad) has.
const FIRST: [f32; NUMBERS] = [-4.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0];

/// The network.
#[derive(Module, Debug)]
pub struct Detector {
    encoders: Vec<Block>,
    head: Block,
    /// `[class and number, channel, 1, 1]`.
    predict: Param<Tensor<4>>,
    bias: Param<Tensor<1>>,
}

impl Detector {
    /// A network whose weights follow from the seed. `shape.classes` are those that have objects.
    pub fn new(shape: Shape, seed: u32, device: &Device) -> Detector {
        let mut make = Maker::new(seed, device);
        let numbers = shape.classes * NUMBERS;
        let first = TensorData::new(FIRST.repeat(shape.classes), [numbers]);
        Detector {
            encoders: encoders(&mut make, &shape),
            head: Block::new(&mut make, shape.channels, shape.channels, shape.kernel),
            // A tenth of the usual size, so that the first predictions are nearly those of the bias.
            predict: {
                let kernel = make.kernel([numbers, shape.channels, 1, 1]);
                kernel.map(|k| k.mul_scalar(0.1).detach()).set_require_grad(device.is_autodiff())
            },
            bias: make.param(Tensor::from_data(first, device)),
        }
    }

    /// Predictions `[picture, class and number, row, column]` of grids `[picture, plane, row, column]` of any size, for each cell of a
    /// grid that is halved once for each encoder, rounded up.
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let x = relu(self.head.forward(encoded(&self.encoders, x).values));
        let plain = ConvOptions::new([1, 1], [0, 0], [1, 1], 1);
        conv2d(x, self.predict.val(), Some(self.bias.val()), plain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_coarse_cell_gets_its_numbers() {
        let shape = Shape { layers: 3, channels: 4, kernel: 3, planes: 2, classes: 2 };
        let net = |seed| Detector::new(shape, seed, &Device::flex());
        let out = net(1).forward(Tensor::ones([2, 2, 113, 75], &Device::flex()));
        assert_eq!(out.dims(), [2, 2 * NUMBERS, 15, 10]);
        let values = out.to_data().try_to_vec::<f32>().unwrap();
        // Untrained, all confidences are small and all corners about a unit away.
        for (k, of) in values.chunks_exact(150).enumerate() {
            let wanted = FIRST[k % NUMBERS];
            assert!(of.iter().all(|v| (v - wanted).abs() < 1.5), "{k}: {of:?}");
        }
        let bytes = |seed| net(seed).into_record().into_bytes().unwrap().to_vec();
        assert!(bytes(7) == bytes(7) && bytes(7) != bytes(8));
    }
}
