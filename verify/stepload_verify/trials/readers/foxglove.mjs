// Reads a record with Foxglove's own libraries: counts and a checksum of the numbers of each topic.
import { open } from "node:fs/promises";
import { createHash } from "node:crypto";
import { createRequire } from "node:module";

const require = createRequire(process.cwd() + "/");
const { McapIndexedReader } = require("@mcap/core");
const { FileHandleReadable } = require("@mcap/nodejs");
const { loadDecompressHandlers } = require("@mcap/support");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

const file = await open(process.argv[2], "r");
const reader = await McapIndexedReader.Initialize({
  readable: new FileHandleReadable(file),
  decompressHandlers: await loadDecompressHandlers(),
});
const readers = new Map();
const found = {};

function numbers(value, out) {
  if (typeof value === "number") out.push(value);
  else if (typeof value === "bigint") out.push(Number(value));
  else if (ArrayBuffer.isView(value)) for (const each of value) out.push(Number(each));
  else if (value !== null && typeof value === "object")
    for (const key of Object.keys(value)) numbers(value[key], out);
}

for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  if (!readers.has(schema.id)) {
    const text = new TextDecoder().decode(schema.data);
    readers.set(schema.id, new MessageReader(parse(text, { ros2: true })));
  }
  const told = readers.get(schema.id).readMessage(message.data);
  delete told.header;
  const out = [];
  numbers(told, out);
  const about = (found[channel.topic] ??= { count: 0, hash: createHash("sha256") });
  about.count += 1;
  about.hash.update(Buffer.from(Float64Array.from(out).buffer));
}
for (const [topic, about] of Object.entries(found)) {
  console.log(JSON.stringify([topic, about.count, about.hash.digest("hex").slice(0, 16)]));
}
await file.close();
