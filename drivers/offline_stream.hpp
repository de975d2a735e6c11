// The two kinds of captures that offline decoders share: streams in both directions, and datagrams.
#pragma once

#include <cstddef>
#include <functional>
#include <string_view>

#include "drivers/offline.hpp"
#include "drivers/offline_fields.hpp"

namespace drivers {

// What was whole but refused, beside what was skipped.
class Refusals {
 public:
  void add(std::string_view why, std::size_t size);
  SkippedBy with(SkippedBy skipped) const;

 private:
  SkippedBy refused_;
};

class OfflineStream : public OfflineDecoder {
 public:
  OfflineStream(Look (*look)(ByteView), std::size_t frame_max) : look_(look), streams_(frame_max) {}
  void feed(const Captured& captured, const std::function<void(Message)>& out) override;
  SkippedBy skipped() const override { return refusals_.with(streams_.skipped()); }

 protected:
  // Name and fields of a whole frame; or why it is refused.
  virtual std::string_view say(ByteView frame, Message& message) = 0;

 private:
  Look (*look_)(ByteView);
  TwoStreams streams_;
  Refusals refusals_;
};

class OfflineDatagrams : public OfflineDecoder {
 public:
  void feed(const Captured& captured, const std::function<void(Message)>& out) override;
  SkippedBy skipped() const override { return refusals_.with({}); }

 protected:
  virtual std::string_view say(ByteView packet, Message& message) = 0;

 private:
  Refusals refusals_;
};

}  // namespace drivers
