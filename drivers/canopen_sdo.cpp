#include "drivers/canopen_sdo.hpp"

#include <algorithm>
#include <cassert>

namespace drivers::canopen {
namespace {

constexpr std::uint32_t kToggle = 0x05030000, kTimedOut = 0x05040000, kUnknown = 0x05040001,
                        kMemory = 0x05040005, kLength = 0x06070010;
constexpr std::size_t kExpeditedMax = 4, kSegmentMax = 7;

void append(Bytes& bytes, const Sdo& sdo) {
  bytes.insert(bytes.end(), sdo.data.begin(), sdo.data.begin() + sdo.data_size);
}

// Fills a segment with what comes next of `data`.
void fill_segment(Sdo& sdo, const Bytes& data, std::size_t& sent) {
  sdo.data_size = static_cast<std::uint8_t>(std::min(kSegmentMax, data.size() - sent));
  std::copy_n(data.begin() + static_cast<std::ptrdiff_t>(sent), sdo.data_size, sdo.data.begin());
  sent += sdo.data_size;
  sdo.last = sent == data.size();
}

// The beginning of a write or of a reply to a read: expedited if it fits.
void fill_first(Sdo& sdo, const Bytes& data) {
  sdo.size = static_cast<std::uint32_t>(data.size());
  sdo.expedited = !data.empty() && data.size() <= kExpeditedMax;
  if (!sdo.expedited) return;
  sdo.data_size = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), sdo.data.begin());
}

}  // namespace

SdoClient::SdoClient(std::uint8_t node, Address address, bool writes, Bytes data, SdoTimes times)
    : node_(node), address_(address), writes_(writes), data_(std::move(data)), times_(times) {
  assert(!writes || (!data_.empty() && data_.size() <= kBytesMax));
}

SdoClient SdoClient::read(std::uint8_t node, Address address, SdoTimes times) {
  return {node, address, false, {}, times};
}

SdoClient SdoClient::write(std::uint8_t node, Address address, Bytes data, SdoTimes times) {
  return {node, address, true, std::move(data), times};
}

std::optional<hal::CanFrame> SdoClient::step(const hal::CanFrame* frame, hal::Time now) {
  if (done()) return std::nullopt;
  if (phase_ == Phase::idle) {
    phase_ = Phase::first;
    return ask(first_request(), now);
  }
  if (frame != nullptr) {
    const Message message = decode(*frame);
    const Sdo* reply = std::get_if<Sdo>(&message);
    if (reply != nullptr && reply->from_node && reply->node == node_) {
      if (reply->kind == SdoKind::abort) {
        if (Address{reply->index, reply->sub} != address_) return std::nullopt;
        failure_ = SdoFailure{reply->abort_code, true};
        return std::nullopt;
      }
      return phase_ == Phase::first ? on_first_reply(*reply, now) : on_segment(*reply, now);
    }
  }
  return now >= deadline_ ? on_silence(now) : std::nullopt;
}

hal::CanFrame SdoClient::ask(const Sdo& request, hal::Time now) {
  deadline_ = now + times_.reply_max;
  return encode(request);
}

Sdo SdoClient::first_request() const {
  Sdo request;
  request.node = node_;
  request.kind = writes_ ? SdoKind::write_request : SdoKind::read_request;
  request.index = address_.index;
  request.sub = address_.sub;
  if (writes_) fill_first(request, data_);
  return request;
}

std::optional<hal::CanFrame> SdoClient::on_silence(hal::Time now) {
  if (phase_ != Phase::first || tries_ >= times_.retries) return give_up(kTimedOut);
  ++tries_;
  return ask(first_request(), now);
}

std::optional<hal::CanFrame> SdoClient::on_first_reply(const Sdo& reply, hal::Time now) {
  const auto wanted = writes_ ? SdoKind::write_reply : SdoKind::read_reply;
  if (reply.kind != wanted || Address{reply.index, reply.sub} != address_) return std::nullopt;
  if (writes_ && data_.size() <= kExpeditedMax) {
    phase_ = Phase::done;
    return std::nullopt;
  }
  if (reply.expedited) {
    append(data_, reply);
    phase_ = Phase::done;
    return std::nullopt;
  }
  announced_ = reply.size;
  if (announced_.value_or(0) > kBytesMax) return give_up(kMemory);
  phase_ = Phase::segments;
  return next_segment(now);
}

std::optional<hal::CanFrame> SdoClient::on_segment(const Sdo& reply, hal::Time now) {
  const auto wanted = writes_ ? SdoKind::write_segment_reply : SdoKind::read_segment;
  if (reply.kind != wanted) return std::nullopt;
  if (reply.toggle != toggle_)
    return reply == last_ ? std::nullopt : std::optional(give_up(kToggle));
  last_ = reply;
  toggle_ = !toggle_;
  if (writes_) {
    if (sent_ < data_.size()) return next_segment(now);
    phase_ = Phase::done;
    return std::nullopt;
  }
  append(data_, reply);
  if (data_.size() > announced_.value_or(kBytesMax)) return give_up(kLength);
  if (!reply.last) return next_segment(now);
  if (announced_ && data_.size() != *announced_) return give_up(kLength);
  phase_ = Phase::done;
  return std::nullopt;
}

std::optional<hal::CanFrame> SdoClient::next_segment(hal::Time now) {
  Sdo request;
  request.node = node_;
  request.kind = writes_ ? SdoKind::write_segment : SdoKind::read_segment_request;
  request.toggle = toggle_;
  if (writes_) fill_segment(request, data_, sent_);
  return ask(request, now);
}

hal::CanFrame SdoClient::give_up(std::uint32_t abort_code) {
  failure_ = SdoFailure{abort_code, false};
  Sdo abort;
  abort.node = node_;
  abort.kind = SdoKind::abort;
  abort.index = address_.index;
  abort.sub = address_.sub;
  abort.abort_code = abort_code;
  return encode(abort);
}

std::optional<hal::CanFrame> SdoServer::step(const hal::CanFrame& frame) {
  const Message message = decode(frame);
  const Sdo* request = std::get_if<Sdo>(&message);
  const bool to_us = (frame.id & 0x780U) == 0x600 && (frame.id & 0x7FU) == node_;
  if (request == nullptr) {  // Block transfers come here.
    if (!to_us || frame.extended || frame.remote || frame.size != 8) return std::nullopt;
    address_ = {little<std::uint16_t>(frame.data, 1), frame.data[3]};
    return abort(kUnknown);
  }
  if (!to_us) return std::nullopt;
  switch (request->kind) {
    case SdoKind::read_request:
    case SdoKind::write_request:
      address_ = {request->index, request->sub};
      data_.clear();
      sent_ = 0;
      toggle_ = false;
      return request->kind == SdoKind::read_request ? begin_read() : begin_write(*request);
    case SdoKind::read_segment_request:
      return read_segment(*request);
    case SdoKind::write_segment:
      return write_segment(*request);
    default:
      busy_ = Busy::no;
      return std::nullopt;  // The client gave up.
  }
}

Sdo SdoServer::reply(SdoKind kind) const {
  Sdo sdo;
  sdo.node = node_;
  sdo.from_node = true;
  sdo.kind = kind;
  sdo.index = address_.index;
  sdo.sub = address_.sub;
  return sdo;
}

hal::CanFrame SdoServer::abort(std::uint32_t code) {
  busy_ = Busy::no;
  Sdo sdo = reply(SdoKind::abort);
  sdo.abort_code = code;
  return encode(sdo);
}

hal::CanFrame SdoServer::begin_read() {
  auto value = read_(address_);
  if (const auto* code = std::get_if<std::uint32_t>(&value)) return abort(*code);
  data_ = std::move(std::get<Bytes>(value));
  Sdo sdo = reply(SdoKind::read_reply);
  fill_first(sdo, data_);
  busy_ = sdo.expedited ? Busy::no : Busy::reading;
  return encode(sdo);
}

hal::CanFrame SdoServer::begin_write(const Sdo& request) {
  if (request.expedited) {
    busy_ = Busy::no;
    const auto code = write_(address_, ByteView(request.data).first(request.data_size));
    return code != 0 ? abort(code) : encode(reply(SdoKind::write_reply));
  }
  if (request.size.value_or(0) > SdoClient::kBytesMax) return abort(kMemory);
  announced_ = request.size;
  busy_ = Busy::writing;
  return encode(reply(SdoKind::write_reply));
}

hal::CanFrame SdoServer::read_segment(const Sdo& request) {
  if (busy_ != Busy::reading) return abort(kUnknown);
  if (request.toggle != toggle_) return abort(kToggle);
  Sdo sdo;
  sdo.node = node_;
  sdo.from_node = true;
  sdo.kind = SdoKind::read_segment;
  sdo.toggle = toggle_;
  fill_segment(sdo, data_, sent_);
  toggle_ = !toggle_;
  if (sdo.last) busy_ = Busy::no;
  return encode(sdo);
}

hal::CanFrame SdoServer::write_segment(const Sdo& request) {
  if (busy_ != Busy::writing) return abort(kUnknown);
  if (request.toggle != toggle_) return abort(kToggle);
  append(data_, request);
  if (data_.size() > announced_.value_or(SdoClient::kBytesMax)) return abort(kLength);
  Sdo sdo;
  sdo.node = node_;
  sdo.from_node = true;
  sdo.kind = SdoKind::write_segment_reply;
  sdo.toggle = toggle_;
  toggle_ = !toggle_;
  if (!request.last) return encode(sdo);
  busy_ = Busy::no;
  if (announced_ && data_.size() != *announced_) return abort(kLength);
  const auto code = write_(address_, data_);
  return code != 0 ? abort(code) : encode(sdo);
}

}  // namespace drivers::canopen
