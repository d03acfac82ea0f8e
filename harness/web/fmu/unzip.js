// Zip archives, opened with the budgets of harness/host/src/archive.rs: no archive fills the memory, and every file has
// the size and the checksum of its header.

const MOST_ENTRIES = 20000, LONGEST_NAME = 1024; // bytes
// Bytes that all files together may unpack to, and further bytes for each byte of the archive.
const UNPACKED = 64 * 2 ** 20, UNPACKED_PER_BYTE = 8;

/**
 * Returns the files of a zip archive whose names are `wanted`, as a Map from name to bytes; stored or deflated, as in FMUs.
 *
 * @param {Uint8Array} archive
 * @param {(name: string) => boolean} wanted
 * @throws {Error} if the archive is damaged, exceeds the budgets, or has names that not every system can unpack
 */
export async function unzip(archive, wanted) {
  const entries = directory(archive);
  const files = new Map();
  for (const entry of entries) {
    if (!wanted(entry.path) || entry.path.endsWith("/")) continue;
    const bytes = entry.method === 0 ? entry.bytes : await inflated(entry.bytes, entry.size, entry.path);
    if (bytes.length !== entry.size) throw new Error(`${entry.path} has ${bytes.length} bytes (its header says ${entry.size})`);
    if (crc32(bytes) !== entry.checksum) throw new Error(`${entry.path} has another checksum (CRC-32) than its header says`);
    files.set(entry.path, bytes);
  }
  return files;
}

// The entries of an archive's directory: path, method, size once unpacked, checksum, compressed bytes.
function directory(archive) {
  const view = new DataView(archive.buffer, archive.byteOffset, archive.byteLength);
  const [END, ENTRY, FILE] = [0x06054b50, 0x02014b50, 0x04034b50];
  const [END_SIZE, ENTRY_SIZE, FILE_SIZE] = [22, 46, 30];
  const isAt = (at, signature, size) => at + size <= archive.length && view.getUint32(at, true) === signature;
  let end = archive.length - END_SIZE;
  const last = Math.max(end - 0xffff, 0); // a comment of at most 65535 bytes may follow
  while (end >= last && !isAt(end, END, END_SIZE)) end -= 1;
  if (end < last) throw new Error("this is not a zip archive");
  const count = view.getUint16(end + 10, true);
  if (count > MOST_ENTRIES) throw new Error(`the archive has ${count} entries (allowed: ${MOST_ENTRIES})`);
  const most = UNPACKED + UNPACKED_PER_BYTE * archive.length;
  const entries = [], places = new Map();
  let at = view.getUint32(end + 16, true), sum = 0;
  for (let n = 0; n < count; n += 1) {
    if (!isAt(at, ENTRY, ENTRY_SIZE)) throw new Error("the archive's directory is damaged");
    const [flags, method] = [view.getUint16(at + 8, true), view.getUint16(at + 10, true)];
    const [checksum, packed, size] = [16, 20, 24].map((place) => view.getUint32(at + place, true));
    const [name, extra, comment] = [28, 30, 32].map((place) => view.getUint16(at + place, true));
    if (name > LONGEST_NAME) throw new Error(`a name in the archive has ${name} bytes (allowed: ${LONGEST_NAME})`);
    const rawName = archive.subarray(at + ENTRY_SIZE, at + ENTRY_SIZE + name);
    const path = new TextDecoder().decode(rawName);
    const parts = path.replace(/\/$/, "").split("/");
    if (path.includes("\\") || path.includes("\0") || path[1] === ":" || parts.some((part) => ["", ".", ".."].includes(part))) {
      throw new Error(`the archive has the name ${JSON.stringify(path)} (allowed: relative names without empty parts, "." and "..")`);
    }
    const place = parts.map((part) => withoutEnd(part.split(":")[0]).toLowerCase()).join("/");
    const other = places.get(place);
    if (other !== undefined && !(path.endsWith("/") && other.endsWith("/"))) {
      throw new Error(`${JSON.stringify(path)} and ${JSON.stringify(other)} in the archive have the same place on Windows or macOS`);
    }
    places.set(place, path);
    if (flags & 1) throw new Error(`${path} is encrypted (allowed: no encryption)`);
    if (method !== 0 && method !== 8) throw new Error(`${path} is compressed by method ${method} (allowed: 0, 8)`);
    sum += size;
    if (sum > most) throw new Error(`with ${path} the archive unpacks to ${sum} bytes (allowed for ${archive.length} bytes: ${most})`);
    const local = view.getUint32(at + 42, true);
    if (!isAt(local, FILE, FILE_SIZE)) throw new Error(`${path} is damaged: it has no header`);
    const localName = view.getUint16(local + 26, true);
    const begin = local + FILE_SIZE + localName + view.getUint16(local + 28, true);
    const same = localName === name && rawName.every((byte, i) => archive[local + FILE_SIZE + i] === byte);
    if (!same || view.getUint16(local + 8, true) !== method) throw new Error(`${path} is damaged: its two headers differ`);
    if (begin + packed > end) throw new Error(`${path} is damaged: it is cut off`);
    entries.push({ path, method, size, checksum, bytes: archive.subarray(begin, begin + packed) });
    at += ENTRY_SIZE + name + extra + comment;
  }
  return entries;
}

// A part of a name without the full stops and spaces at its end, which Windows drops.
function withoutEnd(part) {
  let end = part.length;
  while (end > 0 && (part[end - 1] === "." || part[end - 1] === " ")) end -= 1;
  return part.slice(0, end);
}

// Undoes deflate; stops at the first byte beyond `size`.
async function inflated(bytes, size, path) {
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader();
  const result = new Uint8Array(size);
  let length = 0;
  for (;;) {
    const { done, value } = await reader.read().catch((why) => {
      throw new Error(`${path} cannot be unpacked: ${why.message}`);
    });
    if (done) return result.subarray(0, length);
    if (length + value.length > size) {
      await reader.cancel().catch(() => {});
      throw new Error(`${path} has more bytes than its header says (${size})`);
    }
    result.set(value, length);
    length += value.length;
  }
}

// CRC-32 of zip archives.
function crc32(bytes) {
  crc32.table ??= Uint32Array.from({ length: 256 }, (_, n) => {
    for (let bit = 0; bit < 8; bit += 1) n = n & 1 ? (n >>> 1) ^ 0xedb88320 : n >>> 1;
    return n;
  });
  let crc = 0xffffffff;
  for (let i = 0; i < bytes.length; i += 1) crc = (crc >>> 8) ^ crc32.table[(crc ^ bytes[i]) & 0xff];
  return (crc ^ 0xffffffff) >>> 0;
}
