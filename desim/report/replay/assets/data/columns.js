// Columns of integers, as columns.py packs them.

// The bytes of a deflated (zlib) block in base64.
async function inflated(text) {
  const binary = atob(text.trim());
  const packed = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) packed[i] = binary.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Named columns of one block. A column is decoded when somebody asks for it.
class Columns {
  constructor(index, bytes) {
    this.index = index;
    this.bytes = bytes;
  }

  has(name) {
    return name in this.index;
  }

  // The rows of a column, a typed array each.
  rows(name) {
    const [offset, rows, count, planes, narrow] = this.index[name];
    const out = [];
    for (let row = 0; row < rows; row++) {
      out.push(planes === 0 ? this.#bits(offset, row, count)
        : this.#integers(offset, row, rows, count, planes, narrow));
    }
    return out;
  }

  // The values of a column of one row.
  values(name) {
    return this.rows(name)[0];
  }

  #bits(offset, row, count) {
    const out = new Uint8Array(count), start = offset + row * ((count + 7) >> 3);
    for (let i = 0; i < count; i++) out[i] = (this.bytes[start + (i >> 3)] >> (i & 7)) & 1;
    return out;
  }

  #integers(offset, row, rows, count, planes, narrow) {
    const out = narrow ? new Int32Array(count) : new Float64Array(count);
    const bytes = this.bytes, plane = rows * count, start = offset + row * count;
    let value = 0;
    if (planes === 1) {
      for (let i = 0; i < count; i++) {
        const code = bytes[start + i];
        out[i] = value += (code >> 1) ^ -(code & 1);
      }
    } else if (planes <= 3) {
      const last = planes === 3;
      for (let i = 0; i < count; i++) {
        const code = bytes[start + i] | bytes[start + plane + i] << 8
          | (last ? bytes[start + 2 * plane + i] << 16 : 0);
        out[i] = value += (code >> 1) ^ -(code & 1);
      }
    } else {
      for (let i = 0; i < count; i++) {
        let code = 0;
        for (let k = planes - 1; k >= 0; k--) code = code * 256 + bytes[start + k * plane + i];
        out[i] = value += code % 2 ? -(code + 1) / 2 : code / 2;
      }
    }
    return out;
  }
}
