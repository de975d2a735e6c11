#include "drivers/ouster.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <numbers>

namespace drivers {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kDeg = std::numbers::pi / 180;
constexpr std::size_t kImuPacket = 48;

// A range is measured from where the beam would be at range 0.
hal::Beam beam_of(const OusterMetadata& m, std::size_t row, std::uint16_t measurement) {
  constexpr std::uint32_t kNear_mm = 1000, kFar_mm = 101000;
  const Eigen::Vector3d near = ouster_point_m(m, row, measurement, kNear_mm);
  const Eigen::Vector3d along = (ouster_point_m(m, row, measurement, kFar_mm) - near) / 100;
  return {(near - along).cast<float>(), along.cast<float>()};
}

hal::ScanPattern pattern_of(const OusterMetadata& m) {
  const auto rows = static_cast<std::uint32_t>(m.rows);
  const auto columns = static_cast<std::uint32_t>(m.columns_per_frame);
  const double step = kTurn / columns;
  const double lowest = m.beam_altitude_deg.back() * kDeg;
  const double highest = m.beam_altitude_deg.front() * kDeg;
  return {step / 2 - std::numbers::pi,
          step,
          lowest,
          (highest - lowest) / std::max(rows - 1, 1U),
          columns,
          rows};
}

}  // namespace

Ouster::Ouster(OusterConfig config, hal::Clock& clock, hal::Datagrams& datagrams, OusterApi api)
    : UdpScanner(config.scan, clock, datagrams), config_(std::move(config)) {
  if (api.link != nullptr)
    asker_.emplace(std::move(api.config), config_.metadata, clock, *api.link, std::move(api.drop),
                   troubles_, [this](OusterMetadata its) { adopt(std::move(its)); });
  adopt(std::move(config_.metadata));
}

hal::Task<void> Ouster::run() {
  using boost::asio::experimental::awaitable_operators::operator&&;
  if (!asker_)
    co_await UdpScanner::run();
  else
    co_await (UdpScanner::run() && asker_->run());
}

// Also in the middle of a scan: the pattern of what may be adopted is the same.
void Ouster::adopt(OusterMetadata metadata) {
  config_.metadata = std::move(metadata);
  const OusterMetadata& m = config_.metadata;
  pattern_ = pattern_of(m);
  cells_.clear();
  row_cones_.clear();
  for (std::size_t row = 0; row < m.rows; ++row) row_cones_.push_back(cone_of(beam_of(m, row, 0)));
  identity_ = {"Ouster", m.model, m.serial_number, m.firmware};
  cells_.reserve(m.rows * m.columns_per_frame);
  for (std::size_t row = 0; row < m.rows; ++row)
    for (std::size_t id = 0; id < m.columns_per_frame; ++id) {
      Cell cell{beam_of(m, row, static_cast<std::uint16_t>(id)), 0, 0, 0};
      const Eigen::Vector3f& d = cell.beam.S_direction;
      cell.azimuth_rad = std::atan2(double{d.y()}, double{d.x()});
      const double at = cell.azimuth_rad + std::numbers::pi;
      const double columns = at / pattern_.azimuth_step_rad;
      cell.column = std::min(static_cast<std::uint32_t>(columns), pattern_.columns - 1);
      cell.off_rad =
          static_cast<float>(std::abs(columns - cell.column - 0.5) * pattern_.azimuth_step_rad);
      cells_.push_back(cell);
    }
}

std::string_view Ouster::check_sender() const {
  if (config_.metadata.profile == OusterProfile::legacy) return {};  // It does not say.
  const std::string& serial = config_.metadata.serial_number;
  if (serial.empty() || serial == std::to_string(packet_.serial_number)) return {};
  return "another sensor's: its serial number is not the metadata's";
}

std::string_view Ouster::read(ByteView bytes, hal::Time arrival) {
  if (bytes.size() == kImuPacket) return {};  // Its IMU's, when sent to the same port.
  if (asker_ && !asker_->refused().empty()) return asker_->refused();
  if (const auto why = decode_ouster(bytes, config_.metadata, packet_); !why.empty()) return why;
  if (const auto why = check_sender(); !why.empty()) return why;
  const auto now_ns = static_cast<std::int64_t>(packet_.columns.front().timestamp_ns);
  if (!last_ns_) period_s_ = packet_period_s();
  const double step_s = last_ns_ ? static_cast<double>(now_ns - *last_ns_) / 1e9 : period_s_;
  if (step_s > 0) fit_.add(now_ns, arrival);
  if (is_new(step_s, period_s_, step_s > 0 ? fit_.last_excess_s() : 0)) last_ns_ = now_ns;
  arrived_ = arrival;
  tell_faults();
  return {};
}

// The columns of a packet say how long a packet is.
double Ouster::packet_period_s() const {
  const auto& columns = packet_.columns;
  const auto span_ns = columns.back().timestamp_ns - columns.front().timestamp_ns;
  const auto count = static_cast<double>(columns.size());
  return static_cast<double>(static_cast<std::int64_t>(span_ns)) / 1e9 * count / (count - 1);
}

void Ouster::tell_faults() {
  const auto now = ouster_faults(packet_);
  if (now == faults_) return;
  for (const Fault* fault : faults_) troubles_.clear(*fault);
  for (const Fault* fault : now) troubles_.set(*fault, "as its packets say");
  faults_ = now;
}

void Ouster::begin() {
  frame_.reset();
  turns_ = -1;  // The first change of frames begins the first whole turn.
}

void Ouster::fill(TurnMerge& into) {
  if (frame_) {
    const auto ahead = static_cast<std::int16_t>(packet_.frame_id - *frame_);
    if (ahead > 0) turns_ += ahead;
    if (ahead > 0) frame_ = packet_.frame_id;
  } else {
    frame_ = packet_.frame_id;
  }
  if (turns_ < 0) return;
  const OusterMetadata& m = config_.metadata;
  const auto& range_mm = packet_.returns[0].range_mm;
  for (std::size_t c = 0; c < m.columns_per_packet; ++c) {
    const OusterColumn& column = packet_.columns[c];
    if (!column.valid) continue;
    for (std::size_t row = 0; row < m.rows; ++row) {
      const Cell& cell = cells_[row * m.columns_per_frame + column.measurement_id];
      const float range_m = static_cast<float>(range_mm[row * m.columns_per_packet + c]) / 1000;
      into.add(cell.column, static_cast<std::uint32_t>(m.rows - 1 - row), range_m, cell.beam,
               cell.off_rad);
    }
  }
}

std::vector<BeamCone> Ouster::cones() const {
  std::vector<BeamCone> rows;
  for (const ConeOfBeam& of_row : row_cones_) rows.insert(rows.begin(), of_row.cone);
  return rows;
}

// As its middle row measures it: the others are a few columns ahead and behind.
UdpScanner::PacketStart Ouster::starts() const {
  const OusterMetadata& m = config_.metadata;
  const double step_rad = kTurn / static_cast<double>(m.columns_per_frame);
  const Eigen::Vector3f& first = cells_[0].beam.S_direction;
  const double zero_rad =
      std::atan2(double{first.y()}, double{first.x()}) + m.beam_azimuth_deg[0] * kDeg;
  return {zero_rad - packet_.columns.front().measurement_id * step_rad,
          fit_.to_ours(last_ns_.value_or(0)).value_or(arrived_)};
}

void Ouster::look(TurnAssembly& into) const {
  const OusterMetadata& m = config_.metadata;
  const auto& range_mm = packet_.returns[0].range_mm;
  for (std::size_t row = 0; row < m.rows; ++row) {
    const std::size_t from_lowest = m.rows - 1 - row;
    if (!into.looks(from_lowest)) continue;
    const auto farther_m = static_cast<float>(row_cones_[row].farther_m);
    for (std::size_t c = 0; c < m.columns_per_packet; ++c) {
      const OusterColumn& column = packet_.columns[c];
      if (!column.valid) continue;
      const std::uint32_t mm = range_mm[row * m.columns_per_packet + c];
      const Cell& cell = cells_[row * m.columns_per_frame + column.measurement_id];
      into.add(from_lowest, cell.azimuth_rad,
               mm == 0 ? 0 : static_cast<float>(mm) / 1000 + farther_m);
    }
  }
}

}  // namespace drivers
