// A second OPC UA client of `sheaf-opcua`, by another author than the first: URL FOLDER USER PASSWORD COMMAND. It prints
// what it saw as JSON.
//
// `connect` logs in; `inspect RECIPE SERIAL` browses, starts a job and waits for its result. The connection is signed and
// encrypted; the client's certificate is created in FOLDER.

// The library reports on stdout, which is for the result alone.
console.log = console.info = console.warn = console.error;

const path = require("node:path");
const opcua = require("node-opcua-client");
const { OPCUACertificateManager } = require("node-opcua-certificate-manager");

const [url, folder, userName, password, command, ...parameters] = process.argv.slice(2);
const VISION = "http://opcfoundation.org/UA/MachineVision";
const INSTANCES = "urn:sheaf:station";
const PATIENCE_MS = 60_000;
const RESULT_READY = 1024;

/** Numbers of the structures that are arguments of StartSingleJob. */
const STRUCTURES = { MeasId: 3015, PartId: 3004, RecipeIdExternal: 3002, ProductId: 3003 };

async function connected() {
  const clientCertificateManager = new OPCUACertificateManager({
    rootFolder: path.join(folder, "node"),
    automaticallyAcceptUnknownCertificate: true,
  });
  await clientCertificateManager.initialize();
  const client = opcua.OPCUAClient.create({
    applicationName: "second client",
    clientCertificateManager,
    securityMode: opcua.MessageSecurityMode.SignAndEncrypt,
    securityPolicy: opcua.SecurityPolicy.Aes256_Sha256_RsaPss,
    endpointMustExist: false,
    connectionStrategy: { maxRetry: 0 },
    defaultTransactionTimeout: PATIENCE_MS,
  });
  await client.connect(url);
  const session = await client.createSession({ type: opcua.UserTokenType.UserName, userName, password });
  return { client, session };
}

/**
 * Lists the common base of ids last, behind the structures that contain such ids. A server may list types in any order, and
 * this library resolves them as it meets them: in this order it once wrote the fields of the base twice.
 */
function listBaseLast(session) {
  const browse = session.browse.bind(session);
  session.browse = async (...of) => {
    const found = await browse(...of);
    const isBase = (reference) => reference.browseName?.name === "BinaryIdBaseDataType";
    for (const one of [found].flat()) one.references?.sort((a, b) => isBase(a) - isBase(b));
    return found;
  };
}

/** Values of all types as JSON. */
function plain(value) {
  if (value instanceof opcua.Variant) return plain(value.value);
  if (Array.isArray(value) || ArrayBuffer.isView(value)) return Array.from(value, plain);
  if (typeof value === "number" && Number.isNaN(value)) return null;
  return value?.text ?? value;
}

function result(of) {
  const content = Object.fromEntries(of.resultContent.map((one) => [one.value.key.name, plain(one.value.value)]));
  return {
    id: of.resultId.id,
    serial: of.partId.id,
    job_id: of.jobId.id,
    recipe: of.internalRecipeId.id,
    version: of.internalRecipeId.version,
    ...content,
  };
}

class Station {
  constructor(session, vision, instances) {
    Object.assign(this, { session, vision, instances });
  }

  node(name) {
    return opcua.coerceNodeId(`ns=${this.instances};s=VisionSystem${name}`);
  }

  async names(node) {
    const { references } = await this.session.browse(node);
    return references.map((reference) => reference.browseName.name);
  }

  async read(name) {
    return (await this.session.read({ nodeId: this.node(name), attributeId: opcua.AttributeIds.Value })).value.value;
  }

  structure(name, fields) {
    const type = opcua.coerceNodeId(`ns=${this.vision};i=${STRUCTURES[name]}`);
    return this.session.constructExtensionObject(type, fields);
  }

  async startJob(recipe, serial) {
    const argument = (value) => ({ dataType: opcua.DataType.ExtensionObject, value });
    const automatic = ".VisionStateMachine.AutomaticModeStateMachine";
    const called = await this.session.call({
      objectId: this.node(automatic),
      methodId: this.node(`${automatic}.StartSingleJob`),
      inputArguments: [
        argument(await this.structure("MeasId", { id: "M-2" })),
        argument(await this.structure("PartId", { id: serial })),
        argument(await this.structure("RecipeIdExternal", { id: recipe })),
        argument(await this.structure("ProductId", { id: "" })),
        { dataType: opcua.DataType.Variant, arrayType: opcua.VariantArrayType.Array, value: [] },
      ],
    });
    const [job, error] = called.outputArguments.map((output) => output.value);
    return { status: called.statusCode.name, job_id: job?.id, error };
  }

  /** Resolves with the fields of the first event of a type that `is` accepts; subscribed once `ready` is called. */
  async event(number, fields, is, ready) {
    const type = opcua.coerceNodeId(`ns=${this.vision};i=${number}`);
    const subscription = await this.session.createSubscription2({
      requestedPublishingInterval: 50,
      requestedLifetimeCount: 1000,
      requestedMaxKeepAliveCount: 10,
      publishingEnabled: true,
    });
    const filter = opcua.constructEventFilter(fields.map((name) => `${this.vision}:${name}`), opcua.ofType(type));
    const item = await subscription.monitor(
      { nodeId: this.node(""), attributeId: opcua.AttributeIds.EventNotifier },
      { samplingInterval: 0, queueSize: 100, discardOldest: false, filter },
      opcua.TimestampsToReturn.Both,
    );
    const seen = new Promise((resolve, reject) => {
      setTimeout(() => reject(new Error("no event")), PATIENCE_MS).unref();
      item.on("changed", (values) => {
        const named = Object.fromEntries(fields.map((name, at) => [name, values[at].value]));
        if (is(named)) resolve(named);
      });
    });
    await ready();
    return seen;
  }
}

async function inspect(station, recipe, serial) {
  const browsed = {
    system: await station.names(station.node("")),
    automatic: await station.names(station.node(".VisionStateMachine.AutomaticModeStateMachine")),
  };
  let started;
  const fields = ["ResultId", "PartId", "JobId", "InternalRecipeId", "ResultContent"];
  const event = await station.event(
    RESULT_READY,
    fields,
    (one) => one.PartId?.id === serial,
    async () => {
      started = await station.startJob(recipe, serial);
      if (started.error !== 0) throw new Error(`refused: ${JSON.stringify(started)}`);
    },
  );
  const lowerFirst = ([name, value]) => [name[0].toLowerCase() + name.slice(1), value];
  return {
    browsed,
    started,
    event: result(Object.fromEntries(Object.entries(event).map(lowerFirst))),
    latest: result(await station.read(".ResultManagement.Results.LatestResult")),
  };
}

async function main() {
  const { client, session } = await connected();
  try {
    listBaseLast(session);
    await session.extractNamespaceDataType();
    const namespaces = await session.readNamespaceArray();
    const station = new Station(session, namespaces.indexOf(VISION), namespaces.indexOf(INSTANCES));
    const state = plain(await station.read(".VisionStateMachine.CurrentState"));
    return command === "connect" ? { state } : await inspect(station, ...parameters);
  } finally {
    await session.close();
    await client.disconnect();
  }
}

main().then(
  (seen) => process.stdout.write(`${JSON.stringify(seen)}\n`, () => process.exit(0)),
  (error) => {
    console.error(error);
    process.exit(1);
  },
);
