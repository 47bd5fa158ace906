//! The Model Context Protocol on stdin and stdout.

use super::arguments::{
    self, DescribeInput, ExamplesInput, KeysInput, RcsInput, SimulateInput, ValidateInput,
};
use super::tools::Tools;
use crate::global::Global;
use catseye::base::error::{Error, Result};
use rmcp::handler::server::ServerHandler;
use rmcp::model::{
    CallToolRequestParams, CallToolResponse, CallToolResult, ContentBlock, ErrorData, Implementation,
    ListToolsResult, PaginatedRequestParams, ServerCapabilities, ServerConfig, Tool, ToolAnnotations,
};
use rmcp::service::{RequestContext, RoleServer, ServerInitializeError, ServiceExt};
use serde_json::Value;
use std::sync::Arc;

const INSTRUCTIONS: &str = "catseye simulates automotive radar: cross sections of targets (rcs), frames of road scenes with samples, maps, \
points and truth (simulate). Units are SI and are in the names; angles are degrees. Axes: x forward, y left, z up; azimuth is positive \
left, elevation positive up. range_rate_mps is positive when a target recedes. Cross sections in dBsm are 10 lg(sigma / 1 m2); the first \
letter of VV, VH, HV, HH is the received polarisation. Scenarios, roads, radars, recipes and studies are TOML files: list_keys lists all \
keys, examples lists files to start from, validate_file checks a file before it is run. Unknown keys are errors. Paths are relative to the \
server's folder; paths outside it are refused. Use simulate with dry_run first for a large scene.";

/// Names of the tools.
pub const NAMES: [&str; 6] = ["rcs", "simulate", "describe", "list_keys", "validate_file", "examples"];

#[derive(Clone)]
struct Server {
    tools: Arc<Tools>,
}

fn listed() -> Vec<Tool> {
    let reads = || ToolAnnotations::new().read_only(true).open_world(false);
    let writes =
        || ToolAnnotations::new().read_only(false).destructive(false).idempotent(true).open_world(false);
    let tool =
        |name: &'static str, about: &'static str| Tool::new(name, about, Arc::new(serde_json::Map::new()));
    vec![
        tool(
            "rcs",
            "Radar cross section of a reflector or a mesh over frequency and direction: a table in dBsm with the peak of each \
             polarisation. More than 2000 rows are written to a CSV file.",
        )
        .with_input_schema::<RcsInput>()
        .with_annotations(writes()),
        tool(
            "simulate",
            "Simulates the frames of a scenario (a file, or its TOML text) into a folder, and returns a summary of the run, the points of \
             its first frames as a table, and the paths of plots. dry_run only reports time, memory and disk space.",
        )
        .with_input_schema::<SimulateInput>()
        .with_annotations(writes()),
        tool(
            "describe",
            "Describes a result: a run, a frame, a dataset, a table of cross sections, an array, a mesh or a TOML file, with counts, axes, \
             band and classes.",
        )
        .with_input_schema::<DescribeInput>()
        .with_annotations(reads()),
        tool(
            "list_keys",
            "Keys of scenario, road, radar, recipe and study files with type, default and description, filtered by a word.",
        )
        .with_input_schema::<KeysInput>()
        .with_annotations(reads()),
        tool(
            "validate_file",
            "Checks a TOML file or text and builds what it describes; returns a summary, or one line with position, value, \
             allowed range and hint.",
        )
        .with_input_schema::<ValidateInput>()
        .with_annotations(reads()),
        tool("examples", "Lists the built-in example scenarios, roads, radars, recipes and studies, or writes one.")
            .with_input_schema::<ExamplesInput>()
            .with_annotations(writes()),
    ]
}

impl Server {
    async fn call(&self, request: CallToolRequestParams) -> Result<Value> {
        let given = request.arguments;
        let tools = self.tools.clone();
        match &*request.name {
            "rcs" => self.tools.rcs(arguments::read(given)?).await,
            "simulate" => {
                let input: SimulateInput = arguments::read(given)?;
                let (input, asked) = aside(move || tools.asked(&input).map(|asked| (input, asked))).await?;
                let answer = self.tools.simulate(&input, &asked).await?;
                let tools = self.tools.clone();
                aside(move || tools.answer(&asked, answer)).await
            }
            "examples" => self.tools.examples(arguments::read(given)?).await,
            "describe" => {
                let input = arguments::read(given)?;
                aside(move || tools.describe(&input)).await
            }
            "list_keys" => {
                let input = arguments::read(given)?;
                aside(move || tools.list_keys(&input)).await
            }
            _ => {
                let input = arguments::read(given)?;
                aside(move || tools.validate_file(&input)).await
            }
        }
    }
}

/// Runs what takes its time on another thread; the protocol goes on. A panic there is an error of the call.
async fn aside<T: Send + 'static>(work: impl FnOnce() -> Result<T> + Send + 'static) -> Result<T> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|e| {
        Err(Error::Failed(format!("the tool failed unexpectedly: {e}; please report this with the input")))
    })
}

/// An error's line as text, and its parts.
fn refusal(e: &Error) -> CallToolResult {
    let mut result = CallToolResult::error(vec![ContentBlock::text(e.to_string())]);
    result.structured_content = Some(e.json());
    result
}

impl ServerHandler for Server {
    fn get_info(&self) -> ServerConfig {
        let me =
            Implementation::new("catseye", env!("CARGO_PKG_VERSION")).with_title("catseye radar simulator");
        ServerConfig::new(ServerCapabilities::builder().enable_tools().build())
            .with_server_info(me)
            .with_instructions(INSTRUCTIONS)
    }

    async fn list_tools(
        &self,
        _: Option<PaginatedRequestParams>,
        _: RequestContext<RoleServer>,
    ) -> Result<ListToolsResult, ErrorData> {
        Ok(ListToolsResult::with_all_items(listed()))
    }

    fn get_tool(&self, name: &str) -> Option<Tool> {
        listed().into_iter().find(|t| t.name == name)
    }

    async fn call_tool(
        &self,
        request: CallToolRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<CallToolResponse, ErrorData> {
        if !NAMES.contains(&&*request.name) {
            let allowed = NAMES.join(", ");
            return Err(ErrorData::invalid_params(
                format!("no tool '{}'; allowed: {allowed}", request.name),
                None,
            ));
        }
        // What a cancelled call computes ends with it.
        let result = tokio::select! {
            found = self.call(request) => found,
            () = context.ct.cancelled() => Err(Error::Interrupted("the call was cancelled".into())),
        };
        Ok(match result {
            Ok(found) => CallToolResult::structured(found),
            Err(e) => refusal(&e),
        }
        .into())
    }
}

/// Serves until stdin ends.
///
/// # Errors
/// Returns an error if the streams fail, or a client does not keep to the protocol.
pub fn serve(tools: Tools, global: &Global) -> Result<()> {
    global.say(&format!("catseye mcp: serving files below {}", tools.root.folder().display()));
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|e| Error::Failed(format!("the server cannot start: {e}")))?;
    let result = runtime.block_on(async {
        let server = Server { tools: Arc::new(tools) };
        match server.serve((tokio::io::stdin(), tokio::io::stdout())).await {
            // A client that goes before it says a word.
            Err(ServerInitializeError::ConnectionClosed(_)) => Ok(()),
            Err(e) => Err(Error::Failed(format!(
                "the client did not start the session as the protocol requires: {e}"
            ))),
            Ok(running) => match running.waiting().await {
                Ok(_) => Ok(()),
                Err(e) => Err(Error::Failed(format!("the server ended unexpectedly: {e}"))),
            },
        }
    });
    // A call whose client has gone is not waited for.
    runtime.shutdown_background();
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tools_have_names_and_schemas() {
        assert_eq!(listed().iter().map(|t| t.name.to_string()).collect::<Vec<_>>(), NAMES);
        for tool in listed() {
            let schema = Value::Object((*tool.input_schema).clone());
            assert_eq!(schema["type"], "object", "{}", tool.name);
            assert_eq!(schema["additionalProperties"], false, "{}", tool.name);
            let inputs = schema["properties"].as_object().unwrap();
            for (name, input) in inputs {
                let about = input["description"].as_str().unwrap_or_default();
                assert!(about.len() > 10, "{} {name}: {input}", tool.name);
            }
        }
    }
}
