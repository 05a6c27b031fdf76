// SPDX-License-Identifier: Apache-2.0
'use strict';

// A worker that decodes one row group of a Parquet file at a time. It has a memory limit of its
// own, so that a damaged size ends the worker and not the program.

const zlib = require('zlib');
const { parentPort, workerData } = require('worker_threads');

const kLargestPage = 1 << 28;

/** Lets `decompress` refuse a size that is too large for a page. */
function limited(decompress) {
  return (bytes, size) => {
    if (size > kLargestPage) throw new RangeError('a page is too large');
    return decompress(bytes, size);
  };
}

async function main() {
  const { parquetMetadataAsync, parquetRead } = await import('hyparquet');
  const { asyncBufferFromFile } = await import('hyparquet/src/node.js');
  const zstd = require('@foxglove/wasm-zstd');
  await zstd.isLoaded;
  const compressors = {
    GZIP: limited((bytes, size) => zlib.gunzipSync(bytes, { maxOutputLength: Math.max(size, 1) })),
    BROTLI: limited((bytes, size) => zlib.brotliDecompressSync(bytes, { maxOutputLength: Math.max(size, 1) })),
    ZSTD: limited((bytes, size) => zstd.decompress(bytes, size)),
  };
  // Times become integers in ns; a Date would lose digits below a millisecond.
  const parsers = {
    timestampFromMilliseconds: (value) => BigInt(value) * 1_000_000n,
    timestampFromMicroseconds: (value) => BigInt(value) * 1000n,
    timestampFromNanoseconds: (value) => BigInt(value),
    stringFromBytes: () => null,
    jsonFromBytes: () => null,
  };
  const file = await asyncBufferFromFile(workerData.file);
  const metadata = await parquetMetadataAsync(file, { parsers, geoparquet: false });
  parentPort.postMessage({
    ready: true,
    schema: metadata.schema.map(({ name, type, num_children: children, logical_type: logical, converted_type: converted }) => ({
      name, type, children: children ?? 0, isTime: logical?.type === 'TIMESTAMP' || /^TIMESTAMP/.test(converted ?? '') })),
    groups: metadata.row_groups.map((group) => Number(group.num_rows)),
  });
  parentPort.on('message', async ({ group, columns }) => {
    try {
      let rowStart = 0;
      for (let i = 0; i < group; ++i) rowStart += Number(metadata.row_groups[i].num_rows);
      const rowEnd = rowStart + Number(metadata.row_groups[group].num_rows);
      const found = {};
      await parquetRead({
        file, metadata, columns, rowStart, rowEnd, compressors, parsers, geoparquet: false,
        onChunk: ({ columnName, columnData, rowStart: first }) => {
          (found[columnName] ??= []).push({ first: first - rowStart, values: columnData });
        },
      });
      parentPort.postMessage({ columns: found });
    } catch (error) {
      parentPort.postMessage({ error: String(error.message) });
    }
  });
}

main().catch((error) => parentPort.postMessage({ fatal: String(error.message) }));
