//! What can be kept of a frame, and the stages that each product needs. Whatever nobody keeps is not made.

use crate::engine::{Extent, Stage};
use crate::scene::scenario::Output;

/// Something that a run or a dataset keeps of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Product {
    /// The samples.
    Samples,
    /// The range-Doppler power maps.
    Map,
    /// The power that each cell of a map has to exceed.
    CfarThreshold,
    /// The spectra over angle behind the points.
    AngleSpectra,
    /// The labelled points.
    Points,
    /// The list of echoes.
    Returns,
    /// The positions at which echoes touch something.
    ReturnPlaces,
    /// Every echo in full, before any is left out.
    Echoes,
    /// Boxes, lanes, lines and markers, with what came back from each object.
    Truth,
    /// The class of each cell of the grids before the radar, and the points in them.
    Masks,
    /// The points of the ideal lidar.
    Lidar,
    /// The plots.
    Plots,
}

/// A row of the table of products.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Need {
    /// The product.
    pub product: Product,
    /// Its key in `[output]` of a scenario, and in `[keep]` of a recipe where that has it.
    pub key: &'static str,
    /// The last stage that it needs; None where it follows from the scene alone.
    pub last: Option<Stage>,
}

impl Product {
    /// The products with the last stage that each needs; a stage needs all before it.
    ///
    /// Counts of points stand in the truth where points are kept, so the truth alone needs no map.
    pub const TABLE: [Need; 12] = {
        const fn need(product: Product, key: &'static str, last: Option<Stage>) -> Need {
            Need { product, key, last }
        }
        [
            need(Product::Samples, "adc", Some(Stage::Synthesis)),
            need(Product::Map, "range_doppler", Some(Stage::Transform)),
            need(Product::CfarThreshold, "cfar_threshold", Some(Stage::Transform)),
            need(Product::AngleSpectra, "angle_spectra", Some(Stage::Angles)),
            need(Product::Points, "points", Some(Stage::Labels)),
            need(Product::Returns, "returns", Some(Stage::Trace)),
            need(Product::ReturnPlaces, "return_places", Some(Stage::Trace)),
            need(Product::Echoes, "echoes", Some(Stage::Trace)),
            need(Product::Truth, "truth", Some(Stage::Trace)),
            need(Product::Masks, "masks", Some(Stage::Angles)),
            need(Product::Lidar, "lidar", None),
            need(Product::Plots, "plots", Some(Stage::Labels)),
        ]
    };

    /// The row of a product.
    pub fn need(self) -> Need {
        Product::TABLE[self as usize]
    }
}

/// The products that are kept of each frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Products(u16);

impl Products {
    /// All of them.
    pub const ALL: Products = Products((1 << Product::TABLE.len()) - 1);

    /// The products whose keys `is_kept` affirms.
    pub fn by_key(is_kept: impl Fn(&str) -> bool) -> Products {
        Product::TABLE
            .iter()
            .filter(|need| is_kept(need.key))
            .fold(Products::default(), |all, need| all.with(need.product))
    }

    /// The products that a scenario's run writes.
    pub fn of_output(output: &Output) -> Products {
        Products::by_key(|key| match key {
            "adc" => output.adc,
            "range_doppler" => output.range_doppler,
            "cfar_threshold" => output.cfar_threshold,
            "angle_spectra" => output.angle_spectra,
            "points" => output.points,
            "returns" => output.returns,
            "return_places" => output.return_places,
            "echoes" => output.echoes,
            "truth" => output.truth,
            "masks" => output.masks,
            "lidar" => output.lidar,
            "plots" => output.plots,
            _ => false,
        })
    }

    /// The same with one more.
    pub fn with(self, product: Product) -> Products {
        Products(self.0 | 1 << product as u16)
    }

    /// The same without one of them.
    pub fn without(self, product: Product) -> Products {
        Products(self.0 & !(1 << product as u16))
    }

    /// Whether a product is kept.
    pub fn has(self, product: Product) -> bool {
        self.0 & 1 << product as u16 != 0
    }

    /// The last stage that any of them needs; None where all follow from the scene alone.
    pub fn last_stage(self) -> Option<Stage> {
        Product::TABLE.iter().filter(|need| self.has(need.product)).filter_map(|need| need.last).max()
    }

    /// Whether a stage is needed.
    pub fn reaches(self, stage: Stage) -> bool {
        self.last_stage().is_some_and(|last| last >= stage)
    }

    /// How far an engine carries the frame.
    pub fn extent(self) -> Extent {
        Extent { samples: self.has(Product::Samples), last: self.last_stage() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_the_products() {
        for (i, need) in Product::TABLE.iter().enumerate() {
            assert_eq!(need.product as usize, i, "{}", need.key);
            assert_eq!(need.product.need(), *need);
        }
        assert_eq!(Products::ALL.last_stage(), Some(Stage::Labels));
        assert_eq!(Products::default().last_stage(), None);
    }
}
