#include "drivers/offline_stream.hpp"

#include <utility>

namespace drivers {

void Refusals::add(std::string_view why, std::size_t size) {
  drivers::skip(refused_, why, size);
}

SkippedBy Refusals::with(SkippedBy skipped) const {
  drivers::add(skipped, refused_);
  return skipped;
}

void OfflineStream::feed(const Captured& captured, const std::function<void(Message)>& out) {
  Resync& stream = streams_.of(captured.from_device);
  stream.feed(captured.bytes);
  while (const auto frame = stream.next(look_)) {
    Message message{"", captured.t_s, captured.from_device, {}};
    const auto why = say(*frame, message);
    why.empty() ? out(std::move(message)) : refusals_.add(why, frame->size());
  }
}

void OfflineDatagrams::feed(const Captured& captured, const std::function<void(Message)>& out) {
  Message message{"", captured.t_s, captured.from_device, {}};
  const auto why = say(captured.bytes, message);
  why.empty() ? out(std::move(message)) : refusals_.add(why, captured.bytes.size());
}

}  // namespace drivers
