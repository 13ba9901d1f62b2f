// The file of a recording: proto/WIRE.md, "Recordings".
export const magic = "PNEUMARC";
export const indexMagic = "PNEUMAIX";
export const version = 1;
export const kinds = { header: 1, message: 2, index: 3 };
export const prefixBytes = 9; // length, checksum, kind
export const lengthMax = 64 * 1024 * 1024; // of a record
