// Files of a zip archive whose names are `wanted`, as a Map from name to bytes; stored or deflated, as in FMUs.
export async function unzip(archive, wanted) {
  const view = new DataView(archive.buffer, archive.byteOffset, archive.byteLength);
  const [END, ENTRY, FILE] = [0x06054b50, 0x02014b50, 0x04034b50];
  let end = archive.length - 22; // the shortest end of a directory; a comment may follow
  while (end >= 0 && view.getUint32(end, true) !== END) end -= 1;
  if (end < 0) throw new Error("this is no zip archive");
  const files = new Map();
  let at = view.getUint32(end + 16, true);
  for (let count = view.getUint16(end + 10, true); count > 0; count -= 1) {
    if (view.getUint32(at, true) !== ENTRY) throw new Error("the archive's directory is damaged");
    const [method, size] = [view.getUint16(at + 10, true), view.getUint32(at + 20, true)];
    const [name, extra, comment] = [28, 30, 32].map((place) => view.getUint16(at + place, true));
    const path = new TextDecoder().decode(archive.subarray(at + 46, at + 46 + name));
    if (wanted(path)) {
      const local = view.getUint32(at + 42, true);
      if (view.getUint32(local, true) !== FILE) throw new Error(`${path} is damaged`);
      const begin = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
      const bytes = archive.subarray(begin, begin + size);
      if (method !== 0 && method !== 8) throw new Error(`${path} is compressed by method ${method} (allowed: 0, 8)`);
      files.set(path, method === 0 ? bytes : await inflated(bytes));
    }
    at += 46 + name + extra + comment;
  }
  return files;
}

/** What deflate made of bytes, undone. */
export async function inflated(bytes, format = "deflate-raw") {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream(format));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
