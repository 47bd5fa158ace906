//! `catseye mcp`, spoken to in lines of JSON-RPC as clients do.

#[cfg(not(feature = "mcp"))]
#[test]
fn a_build_without_it_says_so() {
    let t = tempfile::tempdir().unwrap();
    crate::common::refused(t.path(), &["mcp"], &["built without", "--features mcp"]);
}

#[cfg(feature = "mcp")]
mod served {
    use crate::common::{catseye, done, refused, root, text};
    use serde_json::{Value, json};
    use std::collections::BTreeSet;
    use std::fs;
    use std::io::{BufRead, BufReader, Write};
    use std::path::Path;
    use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

    /// A server with a client's ends of its streams.
    struct Client {
        server: Child,
        to: Option<ChildStdin>,
        from: BufReader<ChildStdout>,
        last: u64,
    }

    impl Client {
        fn new(folder: &Path, more: &[&str]) -> Client {
            let mut server = Command::new(env!("CARGO_BIN_EXE_catseye"))
                .current_dir(folder)
                .args(["mcp", "--device", "cpu", "--quiet"])
                .args(more)
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .spawn()
                .unwrap();
            let (to, from) = (server.stdin.take(), BufReader::new(server.stdout.take().unwrap()));
            let mut client = Client { server, to, from, last: 0 };
            let hello = json!({ "protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": { "name": "test", "version": "1" } });
            let answer = client.ask("initialize", hello);
            assert_eq!(answer["result"]["serverInfo"]["name"], "catseye", "{answer}");
            assert!(
                answer["result"]["instructions"].as_str().unwrap().contains("positive when a target recedes")
            );
            client.say(&json!({ "jsonrpc": "2.0", "method": "notifications/initialized" }).to_string());
            client
        }

        fn say(&mut self, line: &str) {
            let to = self.to.as_mut().unwrap();
            writeln!(to, "{line}").unwrap();
            to.flush().unwrap();
        }

        /// The next line, which is JSON: nothing else is on the server's stdout.
        fn line(&mut self) -> Value {
            let mut line = String::new();
            assert!(self.from.read_line(&mut line).unwrap() > 0, "the server closed its stdout");
            serde_json::from_str(&line).unwrap_or_else(|e| panic!("{e}: {line}"))
        }

        fn ask(&mut self, method: &str, params: Value) -> Value {
            self.last += 1;
            let id = self.last;
            self.say(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }).to_string());
            let answer = self.line();
            assert_eq!(answer["id"], id, "{answer}");
            answer
        }

        /// What a tool answers to inputs that are right.
        fn tool(&mut self, name: &str, arguments: Value) -> Value {
            let answer = self.ask("tools/call", json!({ "name": name, "arguments": arguments }));
            let result = &answer["result"];
            assert_eq!(result["isError"], false, "{answer}");
            let shown: Value = serde_json::from_str(result["content"][0]["text"].as_str().unwrap()).unwrap();
            assert_eq!(shown, result["structuredContent"], "the text is the structured content");
            shown
        }

        /// The line of a tool's error, which says all of `parts`.
        fn wrong(&mut self, name: &str, arguments: Value, parts: &[&str]) -> Value {
            let answer = self.ask("tools/call", json!({ "name": name, "arguments": arguments }));
            let result = &answer["result"];
            assert_eq!(result["isError"], true, "{answer}");
            let line = result["content"][0]["text"].as_str().unwrap();
            assert!(!line.contains('\n'), "{line}");
            for part in parts {
                assert!(line.contains(part), "'{part}' is not in: {line}");
            }
            assert_eq!(result["structuredContent"]["error"]["message"], line);
            result["structuredContent"]["error"].clone()
        }

        /// Ends the server as clients do.
        fn end(mut self) {
            drop(self.to.take());
            let mut rest = String::new();
            std::io::Read::read_to_string(&mut self.from, &mut rest).unwrap();
            assert_eq!(rest, "", "nothing is said at the end");
            assert_eq!(self.server.wait().unwrap().code(), Some(0));
        }
    }

    const SCENARIO: &str = "name = \"point\"\nseed = 7\nradar = \"demo77\"\n[[point]]\nposition_m = [30, 4, 0]\nvelocity_mps = [-3, 0, 0]\n\
                            rcs_dbsm = 15\nclass = \"car\"\n";

    #[test]
    fn tools_are_listed_with_their_inputs() {
        let t = tempfile::tempdir().unwrap();
        let mut c = Client::new(t.path(), &[]);
        let tools = c.ask("tools/list", json!({}))["result"]["tools"].clone();
        let names: Vec<&str> =
            tools.as_array().unwrap().iter().map(|t| t["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["rcs", "simulate", "describe", "list_keys", "validate_file", "examples"]);
        for tool in tools.as_array().unwrap() {
            assert_eq!(tool["inputSchema"]["type"], "object");
            assert!(tool["description"].as_str().unwrap().len() > 40);
        }
        assert_eq!(tools[0]["inputSchema"]["required"], json!(["target"]));
        let answer = c.ask("tools/call", json!({ "name": "rsc", "arguments": {} }));
        assert!(answer["error"]["message"].as_str().unwrap().contains("no tool 'rsc'"), "{answer}");
        c.end();
    }

    /// The numbers are those of the command, to the bit, and the trihedral's peak is that of CONVENTIONS.
    #[test]
    fn rcs_is_what_the_command_prints() {
        let t = tempfile::tempdir().unwrap();
        let mut c = Client::new(t.path(), &[]);
        let found = c.tool(
            "rcs",
            json!({ "target": "trihedral:leg_m=0.1", "azimuth_deg": [-10, 0, 10], "elevation_deg": 35.2644, "polarisation": ["circular"] }),
        );
        let options = [
            "--azimuth-deg=-10,0,10",
            "--elevation-deg=35.2644",
            "--polarisation=circular",
            "--json",
            "--device=cpu",
        ];
        let printed: Value = serde_json::from_str(&done(
            t.path(),
            &[&["rcs", "trihedral:leg_m=0.1"][..], &options[..]].concat(),
        ))
        .unwrap();
        let columns: Vec<&str> =
            found["columns"].as_array().unwrap().iter().map(|c| c.as_str().unwrap()).collect();
        let (rows, theirs) = (found["rows"].as_array().unwrap(), printed["rows"].as_array().unwrap());
        assert_eq!((rows.len(), theirs.len()), (3, 3));
        for (row, theirs) in rows.iter().zip(theirs) {
            for (k, name) in columns.iter().enumerate() {
                let their = theirs.get(*name).unwrap_or(&theirs["derived_dbsm"][*name]);
                assert_eq!(&row[k], their, "{name}");
            }
        }
        assert!(columns.len() > 7, "{columns:?}");
        let peak = &found["peaks"]["vv_dbsm"];
        assert!((peak["dbsm"].as_f64().unwrap() - 14.53).abs() < 0.01, "{peak}");
        assert_eq!(peak["azimuth_deg"], 0.0);
        assert!(found["note"].as_str().unwrap().contains("azimuth positive left"));
        c.end();
    }

    #[test]
    fn long_tables_are_files() {
        let t = tempfile::tempdir().unwrap();
        let mut c = Client::new(t.path(), &[]);
        for name in ["rcs_0001.csv", "rcs_0002.csv"] {
            let found = c.tool(
                "rcs",
                json!({ "target": "plate:width_m=0.1,height_m=0.1", "azimuth_deg": "-50:50:0.05" }),
            );
            assert_eq!((&found["count"], &found["output"]), (&json!(2001), &json!(name)));
            assert!(found["rows"].is_null());
            let about = c.tool("describe", json!({ "path": name }));
            assert_eq!((&about["rows"], &about["azimuth_deg"]["largest"]), (&json!(2001), &json!(50.0)));
            assert_eq!(about["peaks"]["vv_dbsm"]["azimuth_deg"], found["peaks"]["vv_dbsm"]["azimuth_deg"]);
        }
        c.wrong(
            "rcs",
            json!({ "target": "sphere:radius_m=0.1", "output": "rcs_0001.csv" }),
            &["rcs_0001.csv", "exists", "force"],
        );
        c.end();
    }

    /// The run is that of the command; its points are those of its file, and the point target has its place and its sign.
    #[test]
    fn simulate_describe_and_their_files() {
        let t = tempfile::tempdir().unwrap();
        let mut c = Client::new(t.path(), &[]);
        let checked = c.tool("validate_file", json!({ "text": SCENARIO }));
        assert_eq!((&checked["valid"], &checked["kind"]), (&json!(true), &json!("scenario")));
        let dry =
            c.tool("simulate", json!({ "scenario_toml": SCENARIO, "output": "a/run", "dry_run": true }));
        assert!(dry["dry_run"]["peak_bytes"].as_u64().unwrap() > 0 && !t.path().join("a/run").exists());
        let found = c.tool("simulate", json!({ "scenario_toml": SCENARIO, "output": "a/run" }));
        assert_eq!(fs::read_to_string(t.path().join("a/run.toml")).unwrap(), SCENARIO);
        done(t.path(), &["simulate", "a/run.toml", "-o", "command", "--device", "cpu", "--quiet"]);
        let read = |run: &str| fs::read(t.path().join(run).join("frame_000000/points.csv")).unwrap();
        assert_eq!(read("a/run"), read("command"), "the same bytes as the command's");
        let table = text(&read("a/run"));
        let lines: Vec<&str> = table.lines().filter(|l| !l.starts_with('#')).collect();
        let (columns, rows) = (&found["points"]["columns"], found["points"]["rows"].as_array().unwrap());
        assert_eq!(rows.len(), lines.len() - 1);
        let at = |name: &str| columns.as_array().unwrap().iter().position(|c| c == name).unwrap();
        let best = rows.iter().find(|r| r[at("class")] == "car").unwrap();
        let number = |name: &str| best[at(name)].as_f64().unwrap();
        // The preset stands at (3.6, 0, 0.5) m: closed forms of place and range rate, which is negative on approach.
        let range_m = (26.4f64 * 26.4 + 16.0 + 0.25).sqrt();
        assert!((number("range_m") - range_m).abs() < 0.1, "{best}");
        assert!((number("azimuth_deg") - 4f64.atan2(26.4).to_degrees()).abs() < 1.0, "{best}");
        assert!((number("range_rate_mps") + 3.0 * 26.4 / range_m).abs() < 0.2, "{best}");
        assert_eq!(found["pictures"][0], "a/run/frame_000000/birds_eye.png");
        let about = c.tool("describe", json!({ "path": "a/run" }));
        assert_eq!(about, found["run"]);
        assert_eq!(
            (&about["what"], &about["frames"], &about["points"]),
            (&json!("run"), &json!(1), &json!(rows.len()))
        );
        assert_eq!(about["radars"][0]["carrier_hz"], 77e9);
        assert!(about["points_by_class"]["car"].as_u64().unwrap() >= 1);
        let frame = c.tool("describe", json!({ "path": "a/run/frame_000000" }));
        assert_eq!(frame["radars"][0]["arrays"]["adc.npy"]["type"], "complex64");
        let array = c.tool("describe", json!({ "path": "a/run/frame_000000/range_doppler.npy" }));
        assert_eq!(array["shape"], frame["radars"][0]["arrays"]["range_doppler.npy"]["shape"]);
        done(t.path(), &["reflector", "plate", "-o", "plate.glb"]);
        let mesh = c.tool("describe", json!({ "path": "plate.glb" }));
        assert!(mesh["triangles"].as_u64().unwrap() >= 2, "{mesh}");
        // An existing run stays, and the server lives on after each error.
        c.wrong("simulate", json!({ "scenario_toml": SCENARIO, "output": "a/run" }), &["a/run", "force"]);
        c.wrong(
            "simulate",
            json!({ "scenario_toml": format!("{SCENARIO}x = 1\n"), "output": "b" }),
            &["b.toml:9: point[0].x: unknown key"],
        );
        assert!(!t.path().join("b.toml").exists());
        c.wrong("simulate", json!({ "output": "b" }), &["scenario or scenario_toml"]);
        c.wrong("describe", json!({ "path": "nothing" }), &["path = nothing: no such file"]);
        c.end();
    }

    #[test]
    fn keys_examples_and_checks() {
        let t = tempfile::tempdir().unwrap();
        let mut c = Client::new(t.path(), &[]);
        let keys = c.tool("list_keys", json!({ "kind": "radar", "word": "bandwidth_hz" }));
        assert_eq!(keys["columns"], json!(["file", "key", "type", "default", "required", "description"]));
        assert!(
            keys["rows"].as_array().unwrap().iter().any(|r| r[1].as_str().unwrap().ends_with("bandwidth_hz"))
        );
        c.wrong(
            "list_keys",
            json!({ "kind": "car" }),
            &["kind = car", "scenario, road, radar, recipe, study"],
        );
        let list = c.tool("examples", json!({ "word": "demo" }));
        assert!(list["examples"].as_object().unwrap().contains_key("presets/demo"), "{list}");
        let written = c.tool("examples", json!({ "name": "presets/demo", "output": "ex" }));
        assert_eq!(written["folder"], "ex");
        let checked = c.tool("validate_file", json!({ "path": "ex/presets/demo.toml" }));
        assert_eq!((&checked["valid"], &checked["kind"]), (&json!(true), &json!("scenario")), "{checked}");
        let wrong = c.tool("validate_file", json!({ "text": "name = \"r\"\nrode = 1\n", "kind": "road" }));
        let error = &wrong["error"];
        assert_eq!(
            (&wrong["valid"], &error["line"], &error["key"]),
            (&json!(false), &json!(2), &json!("rode")),
            "{wrong}"
        );
        c.wrong(
            "rcs",
            json!({ "target": "plate", "azimut_deg": 3 }),
            &["azimut_deg", "did you mean 'azimuth_deg'?"],
        );
        c.wrong(
            "rcs",
            json!({ "target": "plate", "azimuth_deg": "0:x:1" }),
            &["azimuth_deg = '0:x:1'", "not a finite number"],
        );
        c.wrong("rcs", json!({ "target": "plat:width_m=1" }), &["plat", "plate"]);
        c.wrong("rcs", json!({ "target": "--help" }), &["target = --help"]);
        c.wrong("rcs", json!({ "bounces": 1 }), &["target: is missing"]);
        c.end();
    }

    /// Nothing is read or written outside: by `..`, by an absolute path, by a link, by a name in a file.
    #[cfg(unix)]
    #[test]
    fn nothing_leads_out_of_the_root() {
        let t = tempfile::tempdir().unwrap();
        let (here, out) = (t.path().join("here"), t.path().join("out"));
        fs::create_dir_all(&here).unwrap();
        fs::create_dir_all(&out).unwrap();
        fs::write(out.join("radar.toml"), fs::read(root().join("scenes/presets/demo77.toml")).unwrap())
            .unwrap();
        done(&out, &["reflector", "plate", "-o", "plate.glb"]);
        std::os::unix::fs::symlink(&out, here.join("link")).unwrap();
        fs::write(here.join("s.toml"), SCENARIO.replace("demo77", "../out/radar.toml")).unwrap();
        fs::write(here.join("linked.toml"), SCENARIO.replace("demo77", "link/radar.toml")).unwrap();
        fs::write(here.join("radar"), "[antenna]\npattern = \"../out/x.csv\"\n").unwrap();
        fs::write(here.join("far.toml"), SCENARIO.replace("demo77", "radar")).unwrap();
        let names = |folder: &Path| -> BTreeSet<String> {
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
        };
        let before = names(&out);
        let mut c = Client::new(t.path(), &["--root", "here"]);
        let says = &["leads out of the folder", "--root DIR"];
        for (tool, arguments) in [
            ("describe", json!({ "path": "../out/plate.glb" })),
            ("describe", json!({ "path": "link/plate.glb" })),
            ("describe", json!({ "path": out.join("plate.glb") })),
            ("rcs", json!({ "target": "../out/plate.glb" })),
            ("rcs", json!({ "target": "link/plate.glb" })),
            ("rcs", json!({ "target": "plate", "output": "../out/x.csv" })),
            ("rcs", json!({ "target": "plate", "output": "link/x.csv" })),
            ("rcs", json!({ "target": "plate", "plot": "/tmp/x.png" })),
            ("simulate", json!({ "scenario": "s.toml", "output": "run" })),
            ("simulate", json!({ "scenario": "linked.toml", "output": "run" })),
            ("simulate", json!({ "scenario": "far.toml", "output": "run" })),
            ("simulate", json!({ "scenario_toml": SCENARIO, "output": "link/run" })),
            (
                "simulate",
                json!({ "scenario_toml": SCENARIO.replace("demo77", "/etc/radar.toml"), "output": "run" }),
            ),
            ("validate_file", json!({ "path": "s.toml" })),
            ("validate_file", json!({ "text": SCENARIO.replace("demo77", "../out/radar.toml") })),
            ("examples", json!({ "name": "presets/demo", "output": "../out" })),
            ("examples", json!({ "name": "presets/demo", "output": "." })),
        ] {
            c.wrong(tool, arguments, says);
        }
        assert_eq!(names(&out), before);
        assert!(!here.join("run").exists() && !here.join("run.toml").exists());
        // The same things inside are allowed.
        fs::copy(out.join("plate.glb"), here.join("plate.glb")).unwrap();
        assert_eq!(c.tool("rcs", json!({ "target": "plate.glb" }))["count"], 1);
        c.end();
        refused(t.path(), &["mcp", "--root", "nowhere"], &["--root = nowhere"]);
    }

    /// Lines that are no JSON, messages that are none of the protocol, notifications that nobody knows: the server lives on.
    #[test]
    fn garbage_does_not_end_it() {
        let t = tempfile::tempdir().unwrap();
        let mut c = Client::new(t.path(), &[]);
        c.say("this is no JSON");
        c.say("");
        c.say("{\"jsonrpc\": \"2.0\", \"method\": \"notifications/unknown\", \"params\": {}}");
        assert_eq!(
            c.tool("rcs", json!({ "target": "point:rcs_dbsm=10" }))["rows"][0][3].as_f64().map(f64::round),
            Some(10.0)
        );
        let answer = c.ask("no/such/method", json!({}));
        assert!(answer["error"]["code"].is_i64(), "{answer}");
        assert!(c.ask("ping", json!({}))["result"].is_object());
        c.end();
        // A client that leaves at once.
        let out = catseye(t.path(), &["mcp"]);
        assert_eq!((out.status.code(), text(&out.stdout)), (Some(0), String::new()));
    }

    /// A call that the client cancels ends with its child, and the next one has its turn.
    #[test]
    fn a_cancelled_call_ends() {
        let t = tempfile::tempdir().unwrap();
        let mut c = Client::new(t.path(), &[]);
        let long = json!({ "name": "simulate", "arguments": { "scenario_toml": SCENARIO, "output": "run", "frames": 100_000 } });
        c.say(&json!({ "jsonrpc": "2.0", "id": 900, "method": "tools/call", "params": long }).to_string());
        let begun = std::time::Instant::now();
        while !t.path().join(".run.unfinished").exists() {
            assert!(begun.elapsed().as_secs() < 120, "the run does not begin");
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        c.say(
            &json!({ "jsonrpc": "2.0", "method": "notifications/cancelled", "params": { "requestId": 900 } })
                .to_string(),
        );
        // Only one command runs at a time: this answer shows that the other has ended.
        assert_eq!(c.tool("rcs", json!({ "target": "sphere:radius_m=0.1" }))["count"], 1);
        assert!(!t.path().join("run").exists());
        c.end();
    }
}
