// Asks an Ouster over HTTP who it is, how it is set and what it complains of.
#pragma once

#include <array>
#include <functional>
#include <string>

#include "drivers/drop_link.hpp"
#include "drivers/ouster_api.hpp"
#include "drivers/ouster_codec.hpp"
#include "drivers/troubles.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"

namespace drivers {

struct OusterAskerConfig {
  std::string host;           // As the request must name it.
  std::uint16_t port = 7502;  // Where its packets are expected.
  // This computer's address as the sensor sees it; empty, or none: not known.
  std::function<std::string()> own_address;
};

// At the start and after every loss its metadata, then its settings and alerts every 10 s. What is
// wrong is named in `troubles`; refused() is why its packets must not be used.
class OusterAsker {
 public:
  // `expected`: what the robot file's metadata say; a sensor of another form is refused. `adopt` is
  // given the sensor's own, where they are not.
  OusterAsker(OusterAskerConfig config, OusterMetadata expected, hal::Clock& clock,
              hal::ByteStream& link, DropLink drop, Troubles& troubles,
              std::function<void(OusterMetadata)> adopt);

  hal::Task<void> run();
  const std::string& refused() const { return refused_; }  // Empty: it is not.

 private:
  hal::Task<bool> look();
  hal::Task<hal::Result<std::string>> ask(std::string_view path);
  hal::Task<void> fill();
  hal::Task<void> discard();
  hal::Result<std::string> failed(const Fault& why, std::string detail);
  bool judge_metadata(const std::string& json);
  std::string other_form(const OusterMetadata& said) const;
  void judge_settings(const OusterSettings& settings);
  void judge_alerts(const std::vector<OusterAlert>& alerts);

  const OusterAskerConfig config_;
  const OusterMetadata expected_;
  hal::Clock& clock_;
  hal::ByteStream& link_;
  DropLink drop_;
  Troubles& troubles_;
  std::function<void(OusterMetadata)> adopt_;
  std::array<std::uint8_t, 4096> piece_{};
  std::size_t got_{};
  bool lost_{}, known_{}, asked_{};
  const Fault* unanswered_{};  // Why the last round had no answers, and its detail.
  std::string unanswered_detail_, refused_;
};

}  // namespace drivers
