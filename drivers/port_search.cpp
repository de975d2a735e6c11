#include "drivers/port_search.hpp"

namespace drivers {
namespace {

constexpr hal::Duration kListen = std::chrono::milliseconds(1200);

}  // namespace

std::vector<int> rates_to_try(int last_baud, std::span<const int> known_bauds,
                              const SetBaud& set_baud) {
  std::vector<int> bauds{last_baud};
  if (set_baud)
    for (const int baud : known_bauds)
      if (baud != last_baud) bauds.push_back(baud);
  return bauds;
}

hal::Task<Found> search_port(hal::Clock& clock, const std::vector<int>& bauds,
                             std::function<hal::Task<Found>(int baud)> ask_at) {
  const hal::Time listened = clock.now() + kListen;
  do {
    for (const int baud : bauds) {
      const Found found = co_await ask_at(baud);
      if (found != Found::nothing) co_return found;
    }
  } while (clock.now() < listened);
  co_return Found::nothing;
}

}  // namespace drivers
