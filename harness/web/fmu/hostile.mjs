// Archives and descriptions that a page or Node.js must refuse with a sentence, or read in a time that grows linearly with
// their length. Exit code 0 if all holds.
//
//   node hostile.mjs

import assert from "node:assert/strict";
import { deflateRawSync } from "node:zlib";
import { readDescription } from "./description.js";
import { unzip } from "./unzip.js";

// CRC-32, bit by bit.
const crc = (bytes) => {
  let value = ~0;
  for (const byte of bytes) {
    value ^= byte;
    for (let bit = 0; bit < 8; bit += 1) value = (value >>> 1) ^ (value & 1 ? 0xedb88320 : 0);
  }
  return ~value >>> 0;
};

// An archive of [name, content] with deflated files; `change` may alter the header of each.
function zip(files, change = () => {}) {
  const parts = [], entries = [];
  let offset = 0;
  for (const [name, content] of files) {
    const raw = Buffer.from(content), bytes = deflateRawSync(raw), path = Buffer.from(name);
    const header = { flags: 0, method: 8, checksum: crc(raw), packed: bytes.length, size: raw.length };
    change(header);
    const fields = Buffer.alloc(26);
    fields.writeUInt16LE(20, 0);
    fields.writeUInt16LE(header.flags, 2);
    fields.writeUInt16LE(header.method, 4);
    fields.writeUInt32LE(header.checksum, 10);
    fields.writeUInt32LE(header.packed, 14);
    fields.writeUInt32LE(header.size, 18);
    fields.writeUInt16LE(path.length, 22);
    const rest = Buffer.alloc(14);
    rest.writeUInt32LE(offset, 10);
    entries.push(Buffer.concat([Buffer.from("PK\x01\x02\x14\x00"), fields, rest, path]));
    parts.push(Buffer.concat([Buffer.from("PK\x03\x04"), fields, path, bytes]));
    offset += parts.at(-1).length;
  }
  const directory = Buffer.concat(entries), end = Buffer.alloc(22);
  end.write("PK\x05\x06");
  end.writeUInt16LE(files.length, 8);
  end.writeUInt16LE(files.length, 10);
  end.writeUInt32LE(directory.length, 12);
  end.writeUInt32LE(offset, 16);
  return new Uint8Array(Buffer.concat([...parts, directory, end]));
}

const read = (archive) => unzip(archive, () => true);
const content = "x".repeat(1000);
assert.equal(new TextDecoder().decode((await read(zip([["b/", ""], ["a", content]]))).get("a")), content);

const whole = zip([["a", content]]);
for (const [archive, why] of [
  [zip([["a", content]], (header) => { header.checksum ^= 1; }), /checksum/],
  [zip([["a", content]], (header) => { header.size -= 1; }), /more bytes than its header says/],
  [zip([["a", content]], (header) => { header.size += 1; }), /has 1000 bytes/],
  [zip([["a", content]], (header) => { header.size = 0xfffffffe; }), /unpacks to 4294967294 bytes/],
  [zip([["a", content]], (header) => { header.packed = 0xfffffff; }), /cut off/],
  [zip([["a", content]], (header) => { header.method = 12; }), /method 12/],
  [zip([["a", content]], (header) => { header.flags = 1; }), /encrypted/],
  [zip(Array.from({ length: 20001 }, (_, n) => [`f${n}`, ""])), /20001 entries/],
  [zip([["n".repeat(1025), ""]]), /1025 bytes/],
  ...["./a", "b//a", "b/../a", "/a", "b\\a", "c:a"].map((name) => [zip([[name, ""]]), /the name/]),
  ...[["a", "a"], ["b/a", "B/A"], ["b/a", "b/a. "], ["b/a", "b/a::$DATA"]].map((names) =>
    [zip(names.map((name) => [name, ""])), /same place/]),
  [whole.subarray(0, whole.length - 1), /not a zip archive/],
  [new Uint8Array(10 ** 6), /not a zip archive/],
  [new Uint8Array(), /not a zip archive/],
]) {
  await assert.rejects(read(archive), why);
}
// every archive with one wrong byte is read or refused with a sentence of ours, never by a RangeError
for (let at = 0; at < whole.length; at += 1) {
  const bytes = whole.slice();
  bytes[at] ^= 0xff;
  await read(bytes).catch((error) => assert.equal(error.constructor, Error, `byte ${at}: ${error}`));
}

const description = (inside) => `<?xml version="1.0"?><!-- <a --><fmiModelDescription fmiVersion="2.0" modelName='m' guid="g">
  <CoSimulation modelIdentifier="m"/><ModelVariables><ScalarVariable name="a&lt;&#x41;" valueReference="1"><Real start="2"/>
  </ScalarVariable></ModelVariables>${inside}</fmiModelDescription>`;
const found = readDescription(description("<![CDATA[<b ]]>"));
assert.equal(found.variables.get("a<A").start, 2);
for (const [xml, why] of [
  ["<!--".repeat(10), /line 1: <!-- without -->/],
  [description("<!DOCTYPE a>"), /document type declaration/],
  [description('<a b="'), /line 3: <a without >/],
  [description("<a b=1/>"), /<a without >/],
  [description("< a/>"), /< without a name/],
  [description('<a b="&#x110000;"/>'), /up to &#x10ffff;/],
  [description("<Derivatives><Unknown index='9'/></Derivatives>"), /derivative of no variable/],
  [description("<a/>".repeat(300001)), /more than 300000 elements/],
  [" ".repeat(24 * 2 ** 20 + 1), /characters \(allowed: 25165824\)/],
  ["", /FMI no version/],
]) {
  assert.throws(() => readDescription(xml), (error) => error.constructor === Error && why.test(error.message), why.source);
}

// Reading must be linear in the length. Each text has some 2 MB: a quadratic reader takes minutes for it.
for (const piece of ["<!--", "<?", "<![CDATA[", "</", "<a ", '<a b="', "<a b='c' ", "<!---->", "&a", "<a b='&a'/>", " ", "<a\n", "<a>"]) {
  const xml = description(piece.repeat(Math.floor(2e6 / piece.length)));
  try {
    readDescription(xml);
  } catch (error) {
    assert.equal(error.constructor, Error, `${piece}: ${error}`);
  }
}
console.log("hostile archives and descriptions are refused or read");
