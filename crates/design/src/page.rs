//! What the page's script calls.

use super::{Cut, corners, cut, glb, kinds, materials, scene};
use catseye::base::error::Error;
use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console, js_name = error)]
    fn console_error(text: &str);
}

/// Has a fault of the module tell what it is on the browser's console.
#[wasm_bindgen(start)]
pub fn begin() {
    std::panic::set_hook(Box::new(|fault| console_error(&fault.to_string())));
}

/// An error of one line for the script.
fn told(e: Error) -> JsError {
    JsError::new(&e.to_string())
}

/// Kinds of reflectors and names of materials, as JSON.
#[wasm_bindgen(js_name = describe)]
pub fn describe() -> String {
    serde_json::json!({ "kinds": kinds(), "materials": materials() }).to_string()
}

/// A reflector that was made from its specification.
#[wasm_bindgen]
pub struct Target(catseye::scene::Scene);

#[wasm_bindgen]
impl Target {
    /// Makes it; throws an error of one line.
    #[wasm_bindgen(constructor)]
    pub fn new(spec: &str) -> Result<Target, JsError> {
        scene(spec).map(Target).map_err(told)
    }

    /// Corners of its triangles, m.
    pub fn corners(&self) -> Vec<f32> {
        corners(&self.0)
    }

    /// As binary glTF.
    pub fn glb(&self) -> Result<Vec<u8>, JsError> {
        glb(&self.0).map_err(told)
    }

    /// S towards directions, `[direction, 8]`.
    pub fn cut(
        &self,
        frequency_hz: f64,
        azimuth_deg: &[f64],
        elevation_deg: &[f64],
        bounces: usize,
        ptd: bool,
    ) -> Result<Vec<f64>, JsError> {
        cut(&self.0, &Cut { frequency_hz, azimuth_deg, elevation_deg, bounces, ptd }).map_err(told)
    }
}
