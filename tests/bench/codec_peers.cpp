#include "bench/codec_peers.h"

#include <algorithm>
#include <cstdlib>

#include <draco/compression/expert_encode.h>
#include <draco/point_cloud/point_cloud.h>
#include <meshoptimizer.h>
#include <zstd.h>

namespace pneuma::bench {

namespace {

constexpr int zstd_level = 19;

std::size_t zstd_bytes(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> out(ZSTD_compressBound(bytes.size()));
  return ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), zstd_level);
}

std::uint32_t folded(std::int32_t value) {
  return (static_cast<std::uint32_t>(value) << 1) ^ static_cast<std::uint32_t>(value >> 31);
}

/// Each residual in as few whole bytes as all of them fit in, side by side or in planes.
std::vector<std::uint8_t> as_bytes(const std::vector<std::int32_t>& residuals, bool planes) {
  std::uint32_t any = 0;
  for (const std::int32_t residual : residuals) any |= folded(residual);
  const std::size_t width = any < 1U << 8 ? 1 : any < 1U << 16 ? 2 : 4;
  std::vector<std::uint8_t> bytes(width * residuals.size());
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    for (std::size_t byte = 0; byte < width; ++byte) {
      const std::size_t at = planes ? byte * residuals.size() + i : width * i + byte;
      bytes[at] = static_cast<std::uint8_t>((folded(residuals[i]) >> (8 * byte)) & 0xffU);
    }
  }
  return bytes;
}

std::size_t meshoptimizer_bytes(const std::vector<std::int32_t>& residuals) {
  // Its vertices are of a multiple of four bytes.
  const std::size_t count = residuals.size() / 3;
  std::vector<std::int32_t> vertices(3 * count);
  std::ranges::copy(residuals, vertices.begin());
  const std::size_t vertex_bytes = 3 * sizeof(std::int32_t);
  std::vector<std::uint8_t> out(meshopt_encodeVertexBufferBound(count, vertex_bytes));
  out.resize(meshopt_encodeVertexBuffer(out.data(), out.size(), vertices.data(), count, vertex_bytes));
  return zstd_bytes(out);
}

std::size_t draco_bytes(const std::vector<std::int32_t>& residuals) {
  const auto count = static_cast<std::uint32_t>(residuals.size() / 3);
  draco::PointCloud cloud;
  cloud.set_num_points(count);
  draco::GeometryAttribute attribute;
  attribute.Init(draco::GeometryAttribute::GENERIC, nullptr, 3, draco::DT_INT32, false, 3 * sizeof(std::int32_t), 0);
  const int id = cloud.AddAttribute(attribute, true, count);
  for (std::uint32_t i = 0; i < count; ++i) {
    cloud.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &residuals[3 * std::size_t{i}]);
  }
  std::size_t least = SIZE_MAX;
  for (const int prediction : {draco::PREDICTION_NONE, draco::PREDICTION_DIFFERENCE}) {
    draco::ExpertEncoder encoder(cloud);
    encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);  // the other one loses the vertices' order
    encoder.SetSpeedOptions(0, 0);
    if (!encoder.SetAttributePredictionScheme(id, prediction).ok()) continue;
    draco::EncoderBuffer buffer;
    if (encoder.EncodeToBuffer(&buffer).ok()) least = std::min(least, buffer.size());
  }
  return least;
}

}  // namespace

PeerBytes peer_bytes(const std::vector<std::int32_t>& residuals) {
  return {std::min(zstd_bytes(as_bytes(residuals, false)), zstd_bytes(as_bytes(residuals, true))),
          meshoptimizer_bytes(residuals), draco_bytes(residuals)};
}

}  // namespace pneuma::bench
