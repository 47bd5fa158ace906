//! The text of a page.

use super::pack;
use catseye::base::error::{Error, Result};
use serde_json::Value;

/// The page's script and style, which `npm run build` in `web/` makes.
const SCRIPT: &str = include_str!("../assets/view.js");
const STYLE: &str = include_str!("../assets/view.css");
/// The physics for pages in which a reflector is designed, which `scripts/page-module` makes.
const MODULE: &[u8] = include_bytes!("../assets/design.wasm.gz");

/// JSON that may stand in a script element of a page: no text of it can end the element or begin a comment.
pub fn json(value: &Value) -> Result<String> {
    let text = serde_json::to_string(value).map_err(|e| Error::Failed(format!("page: {e}")))?;
    Ok(text.replace('<', "\\u003c").replace('\u{2028}', "\\u2028").replace('\u{2029}', "\\u2029"))
}

/// The script that hands a frame to the page.
pub fn chunk(index: usize, json: &str) -> String {
    format!("catseyeFrame({index},{json});\n")
}

/// What a page has besides its data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum With {
    /// Nothing.
    Nothing,
    /// The module that works out cross sections.
    Physics,
    /// The program that serves it, which it may ask.
    Server,
}

/// The page. `frames` are those that stand in it; `beside` names the folder that holds the others.
pub fn page(
    title: &str,
    data: &Value,
    frames: &[String],
    beside: Option<&str>,
    with: With,
) -> Result<String> {
    let mut data = data.clone();
    data["beside"] = beside.map_or(Value::Null, Value::from);
    let escaped = title.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    // What is loaded is the frames beside the page; nothing reaches the network, and a server only the page that it serves.
    let asked = if with == With::Server { "; connect-src 'self'" } else { "" };
    let policy = format!(
        "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' 'self' file:; style-src 'unsafe-inline'; img-src data: blob:{asked}"
    );
    let module = match with {
        With::Physics => {
            format!(
                "<script type=\"application/octet-stream\" id=\"module\">{}</script>\n",
                pack::base64(MODULE)
            )
        }
        With::Nothing | With::Server => String::new(),
    };
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <title>{escaped}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <noscript>This page draws with a script, which the browser does not run.</noscript>\n\
         <script type=\"application/json\" id=\"data\">{}</script>\n\
         <script type=\"application/json\" id=\"frames\">[{}]</script>\n\
         {module}<script>{SCRIPT}</script>\n</body>\n</html>\n",
        json(&data)?,
        frames.join(",\n"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn names_stay_text() {
        let hostile = "</script><script>alert(1)</script><!-- & \u{2028}";
        let text = page(
            hostile,
            &json!({ "name": hostile }),
            &[json(&json!([hostile])).unwrap()],
            None,
            With::Nothing,
        )
        .unwrap();
        let before = &text[..text.find(SCRIPT).unwrap()];
        assert_eq!(before.matches("<script").count(), 3, "{before}");
        assert!(!before.contains("alert(1)</") && !before.contains("<!-- "), "{before}");
        // What is in the element is the value itself.
        let from = text.find("id=\"data\">").unwrap() + 10;
        let to = from + text[from..].find("</script>").unwrap();
        let back: Value = serde_json::from_str(&text[from..to]).unwrap();
        assert_eq!(back["name"], hostile);
        // The script does not end its own element.
        assert!(!SCRIPT.contains("</script") && !SCRIPT.contains("<!--") && !STYLE.contains("</style"));
    }

    #[test]
    fn nothing_comes_from_the_network() {
        for place in ["src=", "@import", "url(http"] {
            assert!(!STYLE.contains(place), "{place}");
        }
        let whole = SCRIPT.len() + STYLE.len() + MODULE.len().div_ceil(3) * 4;
        assert!(whole < 3 << 20, "{whole}");
    }
}
