// Reads VLP-16 packets of 1206 bytes, one after the other, from the file named first, and prints
// the points that @foxglove/velodyne-cloud finds in each: one JSON list a line, of [x, y, z,
// distance, laser]. "refused" where it finds the packet to be none.
const fs = require("node:fs");
const { Calibration, Model, PointCloud, RawPacket, Transformer } = require(process.argv[3]);

const bytes = fs.readFileSync(process.argv[2]);
const size = Number(process.argv[4] ?? 1206);
const transformer = new Transformer(new Calibration(Model.VLP16), { minRange: 0.001 });
for (let at = 0; at + size <= bytes.length; at += size) {
  try {
    const packet = new RawPacket(bytes.subarray(at, at + size));
    const cloud = new PointCloud({ stamp: 0, maxPoints: RawPacket.MAX_POINTS_PER_PACKET });
    transformer.unpack(packet, 0, 0, cloud);
    cloud.trim();
    const view = new DataView(cloud.data.buffer, cloud.data.byteOffset);
    const points = [];
    for (let i = 0; i < cloud.width; ++i) {
      const from = i * cloud.point_step;
      const point = [0, 4, 8, 12].map((offset) => view.getFloat32(from + offset, true));
      points.push([...point, view.getUint16(from + 20, true)]);
    }
    console.log(JSON.stringify(points));
  } catch {
    console.log('"refused"');
  }
}
