"""A host application of Sparkplug B: PORT GROUP. It prints every message as a line of JSON.

Topics and payloads are decoded by pysparkplug, whose protobuf is that of Eclipse Tahu. A metric that was not announced by a
birth with the same type is named in `unborn`. A line with the name of a node on stdin asks that node for a birth.
"""

import json
import sys

import paho.mqtt.client as mqtt
import pysparkplug as sparkplug

PORT, GROUP = int(sys.argv[1]), sys.argv[2]
births = {}


def show(**fields):
    print(json.dumps(fields), flush=True)


def unborn(metrics, birth):
    def is_born(metric):
        try:
            return birth is not None and birth.get_dtype(metric.name) == metric.datatype
        except KeyError:
            return False

    return [metric.name for metric in metrics if not is_born(metric)]


def receive(_client, _data, received):
    if not received.topic.startswith("spBv1.0/"):
        show(kind="other", topic=received.topic)
        return
    topic = sparkplug.Topic.from_str(received.topic)
    kind, of = topic.message_type.value, (topic.edge_node_id, topic.device_id)
    if kind == "NCMD":
        return
    message = sparkplug.Message.from_mqtt_message(received)
    payload = message.payload
    if kind == "NDEATH":
        metrics = [payload.bd_seq_metric]
    else:
        metrics = payload.metrics
    if kind in ("NBIRTH", "DBIRTH"):
        births[of] = payload
    show(
        kind=kind,
        node=topic.edge_node_id,
        device=topic.device_id,
        seq=getattr(payload, "seq", None),
        qos=received.qos,
        retained=bool(received.retain),
        metrics={metric.name: metric.value for metric in metrics},
        unborn=[] if kind == "NDEATH" else unborn(metrics, births.get(of)),
    )


client = mqtt.Client()
client.on_message = receive
client.on_connect = lambda *_: client.subscribe([(f"spBv1.0/{GROUP}/#", 1), ("sheaf/#", 1)])
client.on_subscribe = lambda *_: show(kind="ready")
client.reconnect_delay_set(1, 1)
client.connect("127.0.0.1", PORT)
client.loop_start()
for line in sys.stdin:
    ask = sparkplug.Metric(timestamp=0, name="Node Control/Rebirth", datatype=sparkplug.DataType.BOOLEAN, value=True)
    command = sparkplug.NCmd(timestamp=0, metrics=(ask,)).encode(include_dtypes=True)
    client.publish(f"spBv1.0/{GROUP}/NCMD/{line.strip()}", command, qos=0)
