"""An OPC UA client of `sheaf-opcua`: URL FOLDER POLICY USER PASSWORD COMMAND. It prints what it saw as JSON.

POLICY is the name of a security policy, or none; USER - is nobody. The client's certificate is created in FOLDER.
`connect` logs in, `browse` reads the address space, `commands` calls every method that changes something, `inspect`
starts a job and waits for its result, `fail` starts one and waits for the end of the fault that it causes, `list` asks
for stored results, `health` reads the health of the station, `follow-health` waits for a fault and for its end.
"""

import asyncio
import json
import logging
import socket
import sys
from datetime import datetime, timezone
from types import SimpleNamespace
from pathlib import Path

from asyncua import Client, ua
from asyncua.crypto import security_policies
from asyncua.crypto.cert_gen import setup_self_signed_certificate
from cryptography.x509.oid import ExtendedKeyUsageOID

logging.getLogger("asyncua").setLevel(logging.ERROR)

URL, FOLDER, POLICY, USER, PASSWORD, COMMAND = sys.argv[1:7]
ARGUMENTS = sys.argv[7:]
VISION = "http://opcfoundation.org/UA/MachineVision"
INSTANCES = "urn:sheaf:station"
DEVICES = "http://opcfoundation.org/UA/DI/"
DEVICE_SET, FUNCTIONAL_GROUP = 5001, 1005
HAS_ADD_IN = 17604
PATIENCE_S = 60
JOB_STARTED, STATE_CHANGED, ERROR, ERROR_RESOLVED, RESULT_READY = 1013, 1018, 1019, 1020, 1024
# The outputs of GetResultComponentsById.
COMPONENTS = [
    "ResultHandle", "IsPartial", "IsSimulated", "ResultState", "MeasId", "PartId", "ExternalRecipeId", "InternalRecipeId",
    "ProductId", "ExternalConfigurationId", "InternalConfigurationId", "JobId", "CreationTime", "ProcessingTimes",
    "ResultContent", "Error",
]
CLIENT_URI = "urn:sheaf:test:client"


async def connected():
    client = Client(URL, timeout=30)
    client.application_uri = CLIENT_URI
    if POLICY != "none":
        key, certificate = Path(FOLDER) / "client.pem", Path(FOLDER) / "client.der"
        await setup_self_signed_certificate(
            key, certificate, CLIENT_URI, socket.gethostname(), [ExtendedKeyUsageOID.CLIENT_AUTH], {"commonName": "client"}
        )
        policy = getattr(security_policies, f"SecurityPolicy{POLICY}")
        await client.set_security(policy, str(certificate), str(key), mode=ua.MessageSecurityMode.SignAndEncrypt)
    if USER != "-":
        client.set_user(USER)
        client.set_password(PASSWORD)
    await client.connect()
    return client


class Seen:
    """Collects events, and wakes whoever waits for one."""

    def __init__(self):
        self.events = []
        self.news = asyncio.Event()

    def event_notification(self, event):
        self.events.append(event)
        self.news.set()

    def of(self, kind):
        return [event for event in self.events if event.EventType.Identifier == kind]

    async def until(self, kind, is_it):
        async with asyncio.timeout(PATIENCE_S):
            while True:
                for event in self.of(kind):
                    if is_it(event):
                        return event
                self.news.clear()
                await self.news.wait()


class Station:
    def __init__(self, client, vision, instances):
        self.client, self.vision, self.instances = client, vision, instances

    def node(self, path):
        return self.client.get_node(ua.NodeId(f"VisionSystem{path}", self.instances))

    async def call(self, path, *arguments):
        parent, _, _ = path.rpartition(".")
        outputs = await self.node(parent).call_method(self.node(path).nodeid, *arguments)
        return outputs

    async def state(self):
        machine = ".VisionStateMachine"
        outer = await self.node(f"{machine}.CurrentState").read_value()
        inner = await self.node(f"{machine}.AutomaticModeStateMachine.CurrentState").read_data_value(False)
        return outer.Text, inner.Value.Value.Text if inner.StatusCode.is_good() else None


def content(result):
    return {pair.Value.Key.Name: pair.Value.Value for pair in map(as_variant, result.ResultContent)}


def as_variant(one):
    return one if isinstance(one, ua.Variant) else ua.Variant(one)


def plain(result):
    values = {key: getattr(value, "Value", value) for key, value in content(result).items()}
    numbers = lambda key: [None if number != number else number for number in values[key]]  # noqa: E731
    return {
        "id": result.ResultId.Id,
        "serial": result.PartId.Id,
        "recipe": result.InternalRecipeId.Id,
        "version": result.InternalRecipeId.Version,
        "job_id": result.JobId.Id,
        "meas_id": result.MeasId.Id if getattr(result, "MeasId", None) else None,
        "simulated": result.IsSimulated,
        "verdict": values["verdict"],
        "ids": values["ids"],
        "values": numbers("values"),
        "expanded_uncertainties": numbers("expanded_uncertainties"),
        "verdicts": values["verdicts"],
        "lower_limits": numbers("lower_limits"),
        "upper_limits": numbers("upper_limits"),
    }


async def browse(station):
    async def tree(node):
        children = await node.get_children()
        return {(await child.read_browse_name()).Name: await tree(child) for child in children}

    kind = await station.node("").read_type_definition()
    latest = station.node(".ResultManagement.Results.LatestResult")
    return {
        "type": [kind.Identifier, kind.NamespaceIndex == station.vision],
        "children": await tree(station.node("")),
        "state": await station.state(),
        "number": await station.node(".VisionStateMachine.CurrentState.Number").read_value(),
        "latest": (await latest.read_data_value(False)).StatusCode.name,
    }


async def start_job(station, recipe, serial):
    return await station.call(
        ".VisionStateMachine.AutomaticModeStateMachine.StartSingleJob",
        ua.MeasIdDataType(Id="M-1"),
        ua.PartIdDataType(Id=serial),
        ua.RecipeIdExternalDataType(Id=recipe),
        ua.ProductIdDataType(Id=""),
        ua.Variant([], ua.VariantType.Variant, is_array=True),
    )


async def subscribe(station, kinds):
    seen = Seen()
    subscription = await station.client.create_subscription(50, seen)
    nodes = [station.client.get_node(ua.NodeId(number, station.vision)) for number in kinds]
    # The server compares types by OfType, not by lists of ids, which asyncua would send; and it keeps one event per item
    # unless it is asked for more.
    await subscription.subscribe_events(station.node(""), nodes, queuesize=100, where_clause_generation=False)
    return seen


async def components(station, result_id):
    outputs = await station.call(".ResultManagement.GetResultComponentsById", result_id, 0)
    return SimpleNamespace(ResultId=result_id, **dict(zip(COMPONENTS, outputs, strict=True)))


async def fail(station, recipe, serial):
    seen = await subscribe(station, [STATE_CHANGED, ERROR, ERROR_RESOLVED, RESULT_READY])
    job, _ = await start_job(station, recipe, serial)
    await seen.until(ERROR_RESOLVED, lambda event: True)
    unfinished = await seen.until(RESULT_READY, lambda event: event.PartId.Id == serial)
    shown = lambda kind: [  # noqa: E731
        {
            "message": event.Message.Text,
            "severity": event.Severity,
            "source": event.SourceName,
            "from": event.FromState.Text,
            "to": event.ToState.Text,
        }
        for event in seen.of(kind)
    ]
    return {
        "error": shown(ERROR),
        "resolved": shown(ERROR_RESOLVED),
        "unfinished": {
            "is_of_job": unfinished.JobId.Id == job.Id,
            "state": unfinished.ResultState,
            "recipe": unfinished.InternalRecipeId.Id,
            "content": unfinished.ResultContent,
            "message": unfinished.Message.Text,
        },
    }


async def inspect(station, recipe, serial):
    seen = await subscribe(station, [STATE_CHANGED, JOB_STARTED, RESULT_READY])
    job, error = await start_job(station, recipe, serial)
    if error:
        return {"error": error}
    event = await seen.until(RESULT_READY, lambda event: event.PartId.Id == serial)
    await seen.until(STATE_CHANGED, lambda event: event.ToState.Text == "Ready")
    result, result_error = (await station.call(".ResultManagement.GetResultById", event.ResultId, 0))[1:]
    latest = await station.node(".ResultManagement.Results.LatestResult").read_value()
    parts = await components(station, event.ResultId)
    missing = await components(station, ua.ResultIdDataType(Id="unknown"))
    states = [event.ToState.Text for event in seen.of(STATE_CHANGED)]
    started = [event.JobId.Id for event in seen.of(JOB_STARTED)]
    return {
        "error": error,
        "job_id": job.Id,
        "event": plain(event),
        "message": event.Message.Text,
        "by_id": plain(result),
        "by_id_error": result_error,
        "latest": plain(latest),
        "components": plain(parts),
        "components_errors": [parts.Error, missing.Error],
        "states": states,
        "started": started,
    }


async def results(station, serial, most, start):
    nothing = [ua.RecipeIdExternalDataType(), ua.RecipeIdInternalDataType()]
    nothing += [ua.ConfigurationIdDataType(), ua.ConfigurationIdDataType(), ua.ProductIdDataType(), ua.JobIdDataType()]
    listed = await station.call(
        ".ResultManagement.GetResultListFiltered",
        ua.Variant(0, ua.VariantType.Int32),
        ua.MeasIdDataType(),
        ua.PartIdDataType(Id=serial),
        *nothing,
        ua.Variant(int(most), ua.VariantType.UInt32),
        ua.Variant(int(start), ua.VariantType.UInt32),
        ua.Variant(0, ua.VariantType.Int32),
    )
    complete, count, _, found, error = listed
    return {"complete": complete, "count": count, "error": error, "results": [plain(one) for one in found or []]}


async def recipes(station):
    listed = await station.call(
        ".RecipeManagement.GetRecipeListFiltered",
        ua.RecipeIdExternalDataType(),
        ua.ProductIdDataType(),
        ua.Variant(2, ua.VariantType.Int32),
        ua.Variant(0, ua.VariantType.UInt32),
        ua.Variant(0, ua.VariantType.UInt32),
        ua.Variant(0, ua.VariantType.Int32),
    )
    return [[one.Id, one.Version, one.Hash.hex() if one.Hash else None] for one in listed[3]]


async def commands(station):
    """The outcome of each: the output `Error`, or the name of the status that refuses the call."""
    cause = [ua.Variant(0, ua.VariantType.Int32), "test"]
    machine, automatic = ".VisionStateMachine", ".VisionStateMachine.AutomaticModeStateMachine"
    external, internal = ua.RecipeIdExternalDataType(Id="bracket"), ua.RecipeIdInternalDataType()
    calls = {
        "PrepareRecipe": lambda: station.call(".RecipeManagement.PrepareRecipe", external, internal),
        "StartSingleJob": lambda: start_job(station, "", "S-prepared"),
        "UnprepareRecipe": lambda: station.call(".RecipeManagement.UnprepareRecipe", external, internal),
        "NoRecipe": lambda: start_job(station, "unknown", "S-1"),
        "NoSerial": lambda: start_job(station, "bracket", "  "),
        "Abort": lambda: station.call(f"{automatic}.Abort", *cause),
        "Stop": lambda: station.call(f"{automatic}.Stop", *cause),
        "Halt": lambda: station.call(f"{machine}.Halt", *cause),
        "Halted": station.state,
        "Reset": lambda: station.call(f"{machine}.Reset", *cause),
        "AfterReset": station.state,
    }
    outcomes = {}
    for name, call in calls.items():
        try:
            outputs = await call()
            is_state = name in ("Halted", "AfterReset")
            outcomes[name] = outputs if is_state else outputs[-1] if isinstance(outputs, list) else outputs
        except ua.UaStatusCodeError as error:
            outcomes[name] = type(error).__name__
    return outcomes


async def health(station):
    """Every variable of the health as [value, status, time in ms]; the condition by the name that its type gives it."""
    devices = await station.client.get_namespace_index(DEVICES)
    values, groups, named = {}, {}, None
    for owner in ("", ".Camera", ".Stage", ".Laser"):
        for group in await station.node(owner).get_children(refs=HAS_ADD_IN):
            path = f"{owner}.{(await group.read_browse_name()).Name}"
            kind = await group.read_type_definition()
            groups[path] = kind == ua.NodeId(FUNCTIONAL_GROUP, devices)
            for variable in await group.get_children():
                name = await variable.read_browse_name()
                read = await variable.read_data_value(False)
                values[f"{path}.{name.Name}"] = shown(read)
                if name == ua.QualifiedName("DeviceHealth", devices):
                    strings = await station.client.get_node(await variable.read_data_type()).get_child("0:EnumStrings")
                    named = [one.Text for one in await strings.read_value()]
    device_set = await station.client.get_node(ua.NodeId(DEVICE_SET, devices)).get_children()
    found = [(await device.read_browse_name()).Name for device in device_set]
    return {"values": values, "groups": groups, "conditions": named, "device_set": sorted(found)}


def shown(read):
    value = read.Value.Value if read.StatusCode.is_good() else None
    at = read.SourceTimestamp
    if isinstance(value, datetime):
        value = milliseconds(value)
    return [getattr(value, "Text", value), read.StatusCode.name, at and milliseconds(at)]


def milliseconds(time):
    return round(time.replace(tzinfo=timezone.utc).timestamp() * 1000)


class Followed:
    """Collects values of one variable."""

    def __init__(self):
        self.values, self.news = [], asyncio.Event()

    def datachange_notification(self, node, value, data):
        self.values.append(shown(data.monitored_item.Value))
        self.news.set()

    async def until(self, wanted):
        async with asyncio.timeout(PATIENCE_S):
            while not self.values or self.values[-1][0] != wanted:
                self.news.clear()
                await self.news.wait()


async def follow_health(station, recipe, serial):
    followed, message = Followed(), station.node(".Stage.Health.Message")
    subscription = await station.client.create_subscription(50, followed)
    await subscription.subscribe_data_change(station.node(".Stage.Health.DeviceHealth"))
    await followed.until(0)
    await start_job(station, recipe, serial)
    await followed.until(1)
    failed = (await message.read_value()).Text
    whole = await station.node(".Health.DeviceHealth").read_value()
    await station.call(".VisionStateMachine.Reset", ua.Variant(0, ua.VariantType.Int32), "test")
    await followed.until(0)
    return {"values": followed.values, "failed": failed, "system": whole, "message": (await message.read_value()).Text}


async def main():
    client = await connected()
    try:
        vision = await client.get_namespace_index(VISION)
        # asyncua knows types of the same names in the base namespace, and then does not look at these.
        for name, number, base in (("TrimmedString", 3017, ua.String), ("Handle", 3018, ua.UInt32)):
            ua.register_basetype(name, ua.NodeId(number, vision), base)
        await client.load_data_type_definitions()
        station = Station(client, vision, await client.get_namespace_index(INSTANCES))
        if COMMAND == "connect":
            return {"state": await station.state()}
        steps = {"browse": browse, "inspect": inspect, "fail": fail, "list": results, "recipes": recipes, "commands": commands}
        steps |= {"health": health, "follow-health": follow_health}
        return await steps[COMMAND](station, *ARGUMENTS)
    finally:
        await client.disconnect()


print(json.dumps(asyncio.run(main())))
