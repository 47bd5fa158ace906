//! The chain in ten lines: a scenario in, points out. README.md shows the body of `main`.

use catseye::engine::{Engine, Precision};
use catseye::{road::site::Site, scene::scenario, simulate};

fn main() -> catseye::Result<()> {
    let text = "name = 'corner'\nradar = 'demo77'\n[[point]]\nposition_m = [33.6, 5, 0.5]\nrcs_dbsm = 10\n";
    let scenario = scenario::parse("corner.toml".as_ref(), text)?;
    let site = Site::new(&scenario)?;
    let engine = Engine::open("auto", Precision::F32)?;
    let frame = simulate::simulate(&engine, &site.scenario, &site.scene, 0)?;
    for p in &frame.points {
        println!("{:.2} m, {:.2} m/s, {:.1} dBsm", p.range_m, p.range_rate_mps, p.rcs_dbsm);
    }
    Ok(())
}
