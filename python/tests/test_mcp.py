"""`catseye mcp`, called by the official client of the Model Context Protocol."""

import asyncio
import contextlib
import json
import math
import os
import subprocess

import pytest

mcp = pytest.importorskip("mcp")
from mcp.client.stdio import StdioServerParameters, stdio_client  # noqa: E402

PROGRAM = os.environ.get("CATSEYE_PROGRAM", "")
pytestmark = pytest.mark.skipif(not PROGRAM, reason="CATSEYE_PROGRAM names no program (a wheel holds none)")

SCENARIO = """
name = "point"
seed = 7
radar = "demo77"
[[point]]
position_m = [30, 4, 0]
velocity_mps = [-3, 0, 0]
rcs_dbsm = 15
class = "car"
"""


def of(thing, name):
    """A field by its name in the protocol, whichever way a version of the client spells it."""
    data = thing.model_dump(by_alias=True, mode="json")
    return data.get(name)


@contextlib.asynccontextmanager
async def session(folder, *more):
    server = StdioServerParameters(command=PROGRAM, args=["mcp", "--device", "cpu", "--quiet", *more], cwd=str(folder))
    async with stdio_client(server) as (read, write), mcp.ClientSession(read, write) as client:
        hello = await client.initialize()
        assert of(hello, "serverInfo")["name"] == "catseye"
        yield client


def served(folder, talk, *more):
    async def run():
        async with session(folder, *more) as client:
            return await asyncio.wait_for(talk(client), 300)

    return asyncio.run(run())


async def found(client, tool, **arguments):
    result = await client.call_tool(tool, arguments)
    assert not of(result, "isError"), of(result, "content")
    content = of(result, "structuredContent")
    assert json.loads(of(result, "content")[0]["text"]) == content
    return content


async def refused(client, tool, **arguments):
    result = await client.call_tool(tool, arguments)
    assert of(result, "isError"), of(result, "content")
    return of(result, "content")[0]["text"]


def test_each_tool(tmp_path):
    async def talk(client):
        tools = of(await client.list_tools(), "tools")
        assert [t["name"] for t in tools] == ["rcs", "simulate", "describe", "list_keys", "validate_file", "examples"]
        assert all(t["inputSchema"]["type"] == "object" and t["description"] for t in tools)

        table = await found(client, "rcs", target="trihedral:leg_m=0.1", elevation_deg=35.2644)
        level = dict(zip(table["columns"], table["rows"][0]))["vv_dbsm"]
        assert level == pytest.approx(14.53, abs=0.01) and table["peaks"]["vv_dbsm"]["dbsm"] == level

        assert (await found(client, "validate_file", text=SCENARIO))["valid"]
        run = await found(client, "simulate", scenario_toml=SCENARIO, output="run")
        points = [dict(zip(run["points"]["columns"], row)) for row in run["points"]["rows"]]
        car = next(p for p in points if p["class"] == "car")
        # The preset stands at (3.6, 0, 0.5) m: closed forms of place and range rate, which is negative on approach.
        assert car["range_m"] == pytest.approx(math.hypot(26.4, 4, 0.5), abs=0.1)
        assert car["azimuth_deg"] == pytest.approx(math.degrees(math.atan2(4, 26.4)), abs=1)
        assert car["range_rate_mps"] == pytest.approx(-3 * 26.4 / math.hypot(26.4, 4, 0.5), abs=0.2)
        assert all((tmp_path / picture).is_file() for picture in run["pictures"])

        about = await found(client, "describe", path="run")
        assert about == run["run"] and about["points"] == len(points)
        keys = await found(client, "list_keys", kind="scenario", word="rcs_dbsm")
        assert any(row[1] == "point[].rcs_dbsm" for row in keys["rows"])
        assert (await found(client, "examples", word="demo"))["count"] > 0
        assert (await found(client, "examples", name="presets/demo"))["folder"] == "scenes"

    served(tmp_path, talk)


def test_bad_input_and_paths_outside(tmp_path):
    (tmp_path / "here").mkdir()
    (tmp_path / "secret.csv").write_text("x_m\n1\n")
    (tmp_path / "here" / "link").symlink_to(tmp_path)

    async def talk(client):
        assert "did you mean 'azimuth_deg'?" in await refused(client, "rcs", target="plate", azimut_deg=1)
        assert "kind = car" in await refused(client, "list_keys", kind="car")
        for path in ("../secret.csv", "link/secret.csv", str(tmp_path / "secret.csv")):
            assert "leads out of the folder" in await refused(client, "describe", path=path)
        assert "leads out of the folder" in await refused(client, "rcs", target="plate", output="../x.csv")
        wrong = await found(client, "validate_file", text="name = 1\n", kind="road")
        assert not wrong["valid"] and wrong["error"]["line"] == 1
        # It lives on.
        assert (await found(client, "rcs", target="sphere:radius_m=0.1"))["count"] == 1

    served(tmp_path, talk, "--root", "here")
    assert not (tmp_path / "x.csv").exists()


def test_garbage_and_the_end_of_stdin(tmp_path):
    hello = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "t", "version": "1"}}
    lines = [
        json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": hello}),
        json.dumps({"jsonrpc": "2.0", "method": "notifications/initialized"}),
        "no JSON at all",
        json.dumps({"jsonrpc": "2.0", "method": "notifications/unknown"}),
        json.dumps({"jsonrpc": "2.0", "id": 2, "method": "tools/list"}),
    ]
    out = subprocess.run([PROGRAM, "mcp"], input="\n".join(lines) + "\n", capture_output=True, text=True, cwd=tmp_path, timeout=60)
    assert out.returncode == 0, out.stderr
    answers = [json.loads(line) for line in out.stdout.splitlines()]
    assert [a["id"] for a in answers] == [1, 2] and len(answers[1]["result"]["tools"]) == 6
