#include "sim/ouster_unit.hpp"

#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>

#include "drivers/http.hpp"
#include "drivers/text.hpp"

namespace sim {
namespace {
constexpr hal::Duration kHttpPause = std::chrono::milliseconds(100);
constexpr std::size_t kHeardMax = 8192;
}  // namespace

OusterUnit::OusterUnit(OusterUnitConfig config, World& world, hal::Clock& clock,
                       DatagramSender& link, UnitFaults& faults, hal::ByteStream* http)
    : config_(std::move(config)),
      world_(world),
      clock_(clock),
      faults_(faults),
      link_(link, clock, faults),
      metadata_text_(config_.metadata_text.empty() ? sample_ouster_metadata()
                                                   : config_.metadata_text),
      settings_(config_.settings) {
  if (http != nullptr) http_.emplace(*http, clock, faults);
  const drivers::OusterMetadata& m = config_.metadata;
  const std::size_t pixels = m.rows * m.columns_per_packet;
  packet_.init_id = 7;
  packet_.serial_number = std::strtoull(m.serial_number.c_str(), nullptr, 10);
  packet_.columns.resize(m.columns_per_packet);
  for (auto& one : packet_.returns) {
    one.range_mm.resize(pixels);
    one.flags.resize(pixels);
    one.reflectivity.resize(pixels);
    one.signal.resize(pixels);
  }
  packet_.near_ir.resize(pixels);
  packet_.window.resize(pixels);
  for (std::size_t row = 0; row < m.rows; ++row)
    for (std::size_t id = 0; id < m.columns_per_frame; ++id) {
      const auto at = [&](std::uint32_t mm) {
        return drivers::ouster_point_m(m, row, static_cast<std::uint16_t>(id), mm);
      };
      const Eigen::Vector3d along = (at(101000) - at(1000)) / 100;
      S_directions_.push_back(along);
      S_origins_m_.push_back(at(1000) - along);
    }
}

OusterUnit::~OusterUnit() = default;

hal::Task<void> OusterUnit::run() {
  using boost::asio::experimental::awaitable_operators::operator&&;
  if (!http_)
    co_await send_packets();
  else
    co_await (send_packets() && serve());
}

hal::Task<void> OusterUnit::serve() {
  std::array<std::uint8_t, 1024> piece;
  for (std::string heard;;) {
    const auto size = co_await http_->read_some(piece);
    if (!size) {
      heard.clear();
      co_await clock_.sleep_for(kHttpPause);
      continue;
    }
    heard += drivers::as_text(drivers::ByteView(piece).first(*size));
    if (heard.size() > kHeardMax) heard.clear();
    while (const auto asked = drivers::parse_http_get(heard)) {
      heard.erase(0, asked->size);
      const std::string answer = answer_to(asked->path);
      (void)co_await http_->write(drivers::as_bytes(answer), static_cast<int>(asked->path.size()));
    }
  }
}

std::string OusterUnit::answer_to(const std::string& path) const {
  const auto ok = [](const std::string& json) { return drivers::http_answer(200, json); };
  if (path == drivers::kOusterMetadataPath && !metadata_text_.empty()) return ok(metadata_text_);
  if (path == drivers::kOusterSettingsPath) return ok(drivers::ouster_settings_json(settings_));
  if (path == drivers::kOusterAlertsPath) return ok(drivers::ouster_alerts_json(alerts_));
  return drivers::http_answer(404, "{}");
}

hal::Task<void> OusterUnit::send_packets() {
  const drivers::OusterMetadata& m = config_.metadata;
  const double packets_per_turn =
      static_cast<double>(m.columns_per_frame) / static_cast<double>(m.columns_per_packet);
  const double period_s = 1 / (config_.turns_per_s * packets_per_turn);
  for (;;) {
    co_await clock_.sleep_for(faults_.slowed(hal::from_seconds(period_s / (1 + config_.skew))));
    if (!faults_.silent()) {
      measure(clock_.now());
      co_await link_.send(drivers::encode_ouster(m, packet_));
    }
    own_ns_ += period_s * 1e9 * faults_.wrong_factor() * faults_.slowness();
    ++number_;
  }
}

// As if the robot had stood as it stands now while the packet was measured.
void OusterUnit::measure(hal::Time at) {
  world_.advance(at);
  const auto& placed = world_.placed_scanner();
  const Eigen::Isometry3d T_W_S =
      (placed ? *placed : world_.robot()).T_W_S(world_.config().scanner.height_m);
  const drivers::OusterMetadata& m = config_.metadata;
  const std::uint64_t first = number_ * m.columns_per_packet;
  const double highest = world_.moving() ? config_.in_motion_max_rad : std::numbers::pi;
  rays_.clear();
  cast_.clear();
  const double column_ns = 1e9 / (config_.turns_per_s * static_cast<double>(m.columns_per_frame));
  for (std::size_t c = 0; c < m.columns_per_packet; ++c) {
    drivers::OusterColumn& column = packet_.columns[c];
    column.timestamp_ns = static_cast<std::uint64_t>(own_ns_ + static_cast<double>(c) * column_ns);
    column.measurement_id = static_cast<std::uint16_t>((first + c) % m.columns_per_frame);
    column.frame_id = static_cast<std::uint16_t>((first + c) / m.columns_per_frame);
    column.encoder = column.measurement_id * 88U;
    column.status = 0xFFFFFFFF;
  }
  for (std::size_t row = 0; row < m.rows; ++row) {
    if (m.beam_altitude_deg[row] * std::numbers::pi / 180 > highest) continue;
    for (std::size_t c = 0; c < m.columns_per_packet; ++c) {
      const std::size_t beam = row * m.columns_per_frame + packet_.columns[c].measurement_id;
      cast_.push_back(row * m.columns_per_packet + c);
      rays_.push_back({T_W_S * S_origins_m_[beam], T_W_S.linear() * S_directions_[beam],
                       (first + c) * m.rows + row});
    }
  }
  packet_.frame_id = packet_.columns.front().frame_id;
  ranges_m_.resize(rays_.size());
  cast_bundle(world_.scene(), config_.ranges, mix(config_.seed), rays_, ranges_m_);
  see_people(world_, config_.ranges, rays_, ranges_m_);
  drivers::OusterReturn& told = packet_.returns[0];
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const double mm = ranges_m_[i] * 1000.0 * faults_.wrong_factor() + 0.5;
    told.range_mm[cast_[i]] = mm < (1 << 19) ? static_cast<std::uint32_t>(mm) : 0;
    told.reflectivity[cast_[i]] = ranges_m_[i] > 0 ? 30 : 0;
    told.signal[cast_[i]] = ranges_m_[i] > 0 ? 400 : 0;
  }
}

std::string sample_ouster_metadata() {
  std::string altitudes, azimuths, shifts;
  for (int row = 0; row < 32; ++row) {
    const std::string comma = row == 0 ? "" : ", ";
    altitudes += comma + std::to_string(21.5 - row * 43.0 / 31);
    azimuths += comma + std::to_string(row % 2 == 0 ? 1.4 : -1.4);
    shifts += comma + std::to_string(row % 2 == 0 ? 4 : -4);
  }
  return R"({"prod_line": "OS-1-32", "prod_sn": "992000000042", "build_rev": "v2.5.2",
"lidar_mode": "1024x10", "beam_altitude_angles": [)" +
         altitudes + R"(], "beam_azimuth_angles": [)" + azimuths +
         R"(], "lidar_origin_to_beam_origin_mm": 15.806,
"lidar_to_sensor_transform": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36.18, 0, 0, 0, 1],
"data_format": {"pixels_per_column": 32, "columns_per_packet": 16, "columns_per_frame": 1024,
"udp_profile_lidar": "RNG19_RFL8_SIG16_NIR16", "column_window": [0, 1023],
"pixel_shift_by_row": [)" +
         shifts + R"(]}})";
}

}  // namespace sim
