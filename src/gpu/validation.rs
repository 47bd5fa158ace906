//! Vulkan's validation layer, which says where a driver is asked for something that the standard does not allow. It is for tests:
//! `CATSEYE_VALIDATE=1` switches it on.
//!
//! wgpu hands what the layer says to the `log` crate and goes on. Here it becomes an error of every submission, and of every opening of
//! a device, that comes after it.

use super::arena::lock;
use std::sync::{Mutex, OnceLock};

/// Environment variable that switches the layer on.
const VARIABLE: &str = "CATSEYE_VALIDATE";

/// Parts of reports that are known to be false, and why.
const KNOWN_FALSE: [(&str, &str); 1] = [(
    "SPIR-V module not valid: Invalid source language operand: 10",
    "10 is WGSL, which layers of before autumn 2023 do not know (seen with 1.3.239); they look no further into that shader",
)];

/// What the layer said. It stays, since some errors are met with a second try.
static REPORTS: Mutex<Vec<String>> = Mutex::new(Vec::new());

struct Collector;

impl log::Log for Collector {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.level() == log::Level::Error && metadata.target().starts_with("wgpu_hal")
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata())
            && let Some(report) = report(record.level(), &record.args().to_string())
        {
            lock(&REPORTS).push(report);
        }
    }

    fn flush(&self) {}
}

/// What a line of wgpu's log says of the layer, if it is an error.
fn report(level: log::Level, line: &str) -> Option<String> {
    // wgpu names the kind of each message first; lines about its objects follow and begin with a tab.
    let is_error = level == log::Level::Error && line.starts_with("VALIDATION");
    (is_error && KNOWN_FALSE.iter().all(|(part, _)| !line.contains(part))).then(|| line.to_string())
}

/// Whether the environment asks for the layer, whose errors are received from then on.
fn is_on() -> bool {
    static IS_ON: OnceLock<bool> = OnceLock::new();
    *IS_ON.get_or_init(|| {
        let asked = std::env::var_os(VARIABLE).is_some_and(|value| !value.is_empty() && value != "0");
        if asked {
            match log::set_logger(&Collector) {
                Ok(()) => log::set_max_level(log::LevelFilter::Error),
                Err(_) => lock(&REPORTS).push(format!(
                    "{VARIABLE} is set, but another logger receives the messages of the layer"
                )),
            }
        }
        asked
    })
}

/// An instance of wgpu, with the layer where the environment asks for it.
pub(super) fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    if is_on() {
        // Without DEBUG wgpu does not listen to the layer.
        descriptor.flags |= wgpu::InstanceFlags::VALIDATION | wgpu::InstanceFlags::DEBUG;
    }
    let instance = wgpu::Instance::new(descriptor);
    if is_on() && !has_layer(&instance) {
        lock(&REPORTS).push(format!(
            "{VARIABLE} is set, but Vulkan has no layer VK_LAYER_KHRONOS_validation: install it (Debian: vulkan-validationlayers)"
        ));
    }
    instance
}

/// Whether Vulkan has the layer. wgpu goes on without it.
#[cfg(not(any(target_os = "macos", target_arch = "wasm32")))]
#[allow(unsafe_code)] // Vulkan is asked directly
fn has_layer(instance: &wgpu::Instance) -> bool {
    // SAFETY: the instance is only asked for the names of layers, and outlives the question.
    let layers = unsafe {
        let Some(hal) = instance.as_hal::<wgpu::hal::api::Vulkan>() else { return false };
        hal.shared_instance().entry().enumerate_instance_layer_properties()
    };
    layers.is_ok_and(|all| all.iter().any(|l| l.layer_name_as_c_str() == Ok(c"VK_LAYER_KHRONOS_validation")))
}

/// Neither Metal nor a browser has such a layer.
#[cfg(any(target_os = "macos", target_arch = "wasm32"))]
fn has_layer(_instance: &wgpu::Instance) -> bool {
    false
}

/// What the layer has said first so far, if anything.
pub(super) fn said() -> Option<String> {
    lock(&REPORTS).first().map(|report| format!("the validation layer reports: {report}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_the_layer_are_told_from_other_lines() {
        use log::Level::{Error, Warn};
        let text = "VALIDATION [VUID-VkBufferCreateInfo-size-00912 (0x7b)]\n\tsize is 0";
        assert_eq!(report(Error, text).unwrap(), text);
        for (level, line) in [
            (Warn, text),
            (Error, "\tobjects: (type: BUFFER, hndl: 0x1, name: ?)"),
            (Error, "GENERAL [Loader Message (0x0)]\n\tno driver is here"),
        ] {
            assert_eq!(report(level, line), None, "{line}");
        }
        for (part, _) in KNOWN_FALSE {
            assert_eq!(report(Error, &format!("VALIDATION [UNASSIGNED (0x6)]\n\t{part}")), None);
        }
    }

    /// A buffer of no bytes is against the standard. wgpu refuses to make one, so it is made behind its back.
    #[cfg(target_os = "linux")]
    #[test]
    #[ignore = "its error is meant for it alone: CATSEYE_VALIDATE=1 scripts/test --lib -- --ignored a_wrong_call"]
    #[allow(unsafe_code)] // Vulkan is called directly
    fn a_wrong_call_fails_the_next_submission() {
        let gpu = crate::gpu::compare::opened_for_tests();
        let submit = || gpu.recorder("valid").submit().map(drop);
        submit().unwrap();
        // SAFETY: nothing uses the buffer, and it is destroyed before its device.
        unsafe {
            let device = gpu.device.as_hal::<wgpu::hal::api::Vulkan>().unwrap();
            if let Ok(buffer) = device.raw_device().create_buffer(&Default::default(), None) {
                device.raw_device().destroy_buffer(buffer, None);
            }
        }
        let e = submit().unwrap_err().to_string();
        assert!(e.contains("the validation layer reports") && e.contains("VUID-VkBufferCreateInfo-"), "{e}");
        // From here on nothing succeeds, so that no second try hides it.
        assert_eq!(submit().unwrap_err().to_string(), e);
    }
}
