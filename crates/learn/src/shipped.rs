//! Trained networks that come with the program, by name.

/// A trained network that comes with the program.
#[derive(Debug, Clone, Copy)]
pub struct Shipped {
    /// Its name on the command line and in scenarios.
    pub name: &'static str,
    /// The training's TOML.
    pub config: &'static str,
    /// The file of its weights.
    pub weights: &'static [u8],
}

macro_rules! shipped {
    ($($name:literal),*) => {
        [$(Shipped {
            name: $name,
            config: include_str!(concat!("../weights/", $name, "/config.toml")),
            weights: include_bytes!(concat!("../weights/", $name, "/weights.bpk")),
        }),*]
    };
}

/// All of them: `road` gives cells of the road grid a class, `markers` tells lanes between rows of markers in theirs, `points` gives the
/// points of a scan a class. Their folders lie in `crates/learn/weights`, each
/// with its model card.
pub const SHIPPED: [Shipped; 3] = shipped!["road", "markers", "points"];

/// The network of this name.
pub fn find(name: &str) -> Option<&'static Shipped> {
    SHIPPED.iter().find(|s| s.name == name)
}

/// Names of all of them in one line.
pub fn names() -> String {
    SHIPPED.map(|s| s.name).join(", ")
}
