#include "drivers/gs_usb.hpp"

#include <boost/asio/error.hpp>
#include <deque>
#include <fstream>
#include <map>
#include <set>

#include "drivers/usb_events.hpp"
#include "hal/wake.hpp"

namespace drivers {
namespace {

namespace errc = boost::system::errc;
using boost::system::error_code;
using gs_usb::Request;

struct Model {
  std::uint16_t vendor, product;
};
constexpr Model kModels[] = {{0x1D50, 0x606F}, {0x1209, 0x2323}, {0x1CD2, 0x606F},
                             {0x16D0, 0x10B8}, {0x16D0, 0x0F30}, {0x1209, 0xCA01}};
constexpr int kInterface = 0;
constexpr std::uint8_t kPut = 0x41, kGet = 0xC1;  // Vendor request to an interface.
constexpr unsigned kRequestTimeoutMs = 1000;
constexpr std::size_t kReads = 16;      // Transfers that wait for frames at any time.
constexpr std::size_t kReadSize = 128;  // A multiple of the packet's; the longest frame has 80.

// A transfer and its bytes. Keeps itself alive while libusb has it.
class Transfer : public std::enable_shared_from_this<Transfer> {
 public:
  Transfer() : raw_(libusb_alloc_transfer(0)) {}
  ~Transfer() { libusb_free_transfer(raw_); }
  Transfer(const Transfer&) = delete;
  Transfer& operator=(const Transfer&) = delete;

  Bytes& bytes() { return bytes_; }
  libusb_transfer* raw() { return raw_; }
  bool under_way() const { return self_ != nullptr; }
  void cancel() {
    if (under_way()) libusb_cancel_transfer(raw_);
  }
  void forget() { when_ended_ = nullptr; }
  static void LIBUSB_CALL ended(libusb_transfer* raw) {
    auto* const self = static_cast<Transfer*>(raw->user_data);
    const auto keep = std::move(self->self_);
    if (self->when_ended_) self->when_ended_();
  }

  error_code submit(std::function<void()> when_ended) {
    when_ended_ = std::move(when_ended);
    self_ = shared_from_this();
    const int code = libusb_submit_transfer(raw_);
    if (code != 0) self_.reset();
    return usb_error(code);
  }

 private:
  libusb_transfer* raw_;
  Bytes bytes_;
  std::function<void()> when_ended_;
  std::shared_ptr<Transfer> self_;
};

struct Endpoints {
  std::uint8_t in = 0x81, out = 0x02;
};

class LibusbPipe final : public UsbPipe {
 public:
  LibusbPipe(std::shared_ptr<UsbEvents> events, libusb_device_handle* handle, std::string name)
      : events_(std::move(events)), handle_(handle), name_(std::move(name)) {}
  ~LibusbPipe() override { close(); }
  LibusbPipe(const LibusbPipe&) = delete;
  LibusbPipe& operator=(const LibusbPipe&) = delete;

  error_code claim();

  std::string name() const override { return name_; }
  void close() override;
  hal::Task<hal::Result<void>> put(Request request, std::uint16_t value, Bytes data) override;
  hal::Task<hal::Result<Bytes>> get(Request request, std::uint16_t value,
                                    std::size_t size) override;
  hal::Task<hal::Result<void>> write(Bytes frame) override;
  hal::Task<hal::Result<Bytes>> read() override;

 private:
  void find_endpoints();
  hal::Task<hal::Result<Bytes>> control(std::uint8_t type, Request request, std::uint16_t value,
                                        Bytes data);
  hal::Task<error_code> perform(std::shared_ptr<Transfer> transfer);
  error_code start_read(const std::shared_ptr<Transfer>& transfer);

  std::shared_ptr<UsbEvents> events_;
  libusb_device_handle* handle_;  // Null when it was given back.
  std::string name_;
  Endpoints endpoints_;
  std::set<std::shared_ptr<Transfer>> transfers_;  // Whatever may be under way.
  std::deque<std::shared_ptr<Transfer>> arrived_;  // At most kReads.
  bool reading_ = false;
  hal::Wake changed_;
};

error_code LibusbPipe::claim() {
  libusb_set_auto_detach_kernel_driver(handle_, 1);
  find_endpoints();
  return usb_error(libusb_claim_interface(handle_, kInterface));
}

void LibusbPipe::find_endpoints() {
  libusb_config_descriptor* config = nullptr;
  if (libusb_get_active_config_descriptor(libusb_get_device(handle_), &config) != 0) return;
  if (config->bNumInterfaces > 0 && config->interface[0].num_altsetting > 0) {
    const auto& setting = config->interface[0].altsetting[0];
    for (int i = 0; i < setting.bNumEndpoints; ++i) {
      const auto& endpoint = setting.endpoint[i];
      if ((endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK)
        continue;
      const bool in = (endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) != 0;
      (in ? endpoints_.in : endpoints_.out) = endpoint.bEndpointAddress;
    }
  }
  libusb_free_config_descriptor(config);
}

// libusb must have given back every transfer before the handle goes.
void LibusbPipe::close() {
  if (handle_ == nullptr) return;
  const auto any_under_way = [this] {
    return std::any_of(transfers_.begin(), transfers_.end(),
                       [](const auto& transfer) { return transfer->under_way(); });
  };
  for (const auto& transfer : transfers_) transfer->cancel();
  for (int i = 0; i < 20 && any_under_way(); ++i) {
    timeval wait{0, GsUsbBus::kCloseMax.count() * 1000 / 20};
    libusb_handle_events_timeout_completed(events_->context(), &wait, nullptr);
  }
  for (const auto& transfer : transfers_) transfer->forget();
  libusb_release_interface(handle_, kInterface);
  libusb_close(std::exchange(handle_, nullptr));
  arrived_.clear();
  changed_.drop();
}

hal::Task<error_code> LibusbPipe::perform(std::shared_ptr<Transfer> transfer) {
  if (handle_ == nullptr) co_return errc::make_error_code(errc::no_such_device);
  struct Listed {
    LibusbPipe& pipe;
    std::shared_ptr<Transfer> transfer;
    ~Listed() {
      if (pipe.handle_ != nullptr) transfer->cancel();  // Where the caller was.
      if (!transfer->under_way()) pipe.transfers_.erase(transfer);
    }
  } const listed{*this, transfer};
  transfers_.insert(transfer);
  if (const error_code error = transfer->submit([this] { changed_.notify(); })) co_return error;
  while (transfer->under_way()) co_await changed_.wait();
  co_return usb_status(transfer->raw()->status);
}

hal::Task<hal::Result<Bytes>> LibusbPipe::control(std::uint8_t type, Request request,
                                                  std::uint16_t value, Bytes data) {
  const auto transfer = std::make_shared<Transfer>();
  Bytes& bytes = transfer->bytes();
  const auto size = static_cast<std::uint16_t>(data.size());
  bytes.resize(LIBUSB_CONTROL_SETUP_SIZE);
  libusb_fill_control_setup(bytes.data(), type, static_cast<std::uint8_t>(request), value,
                            kInterface, size);
  bytes.insert(bytes.end(), data.begin(), data.end());
  libusb_fill_control_transfer(transfer->raw(), handle_, bytes.data(), Transfer::ended,
                               transfer.get(), kRequestTimeoutMs);
  if (const error_code error = co_await perform(transfer)) co_return error;
  const auto* const begin = bytes.data() + LIBUSB_CONTROL_SETUP_SIZE;
  co_return Bytes(begin, begin + transfer->raw()->actual_length);
}

hal::Task<hal::Result<void>> LibusbPipe::put(Request request, std::uint16_t value, Bytes data) {
  auto done = co_await control(kPut, request, value, std::move(data));
  if (!done) co_return done.error();
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<Bytes>> LibusbPipe::get(Request request, std::uint16_t value,
                                              std::size_t size) {
  return control(kGet, request, value, Bytes(size));
}

hal::Task<hal::Result<void>> LibusbPipe::write(Bytes frame) {
  const auto transfer = std::make_shared<Transfer>();
  transfer->bytes() = std::move(frame);
  libusb_fill_bulk_transfer(transfer->raw(), handle_, endpoints_.out, transfer->bytes().data(),
                            static_cast<int>(transfer->bytes().size()), Transfer::ended,
                            transfer.get(), kRequestTimeoutMs);
  if (const error_code error = co_await perform(transfer)) co_return error;
  co_return hal::Result<void>{};
}

error_code LibusbPipe::start_read(const std::shared_ptr<Transfer>& transfer) {
  transfer->bytes().resize(kReadSize);
  libusb_fill_bulk_transfer(transfer->raw(), handle_, endpoints_.in, transfer->bytes().data(),
                            static_cast<int>(kReadSize), Transfer::ended, transfer.get(), 0);
  transfers_.insert(transfer);
  return transfer->submit([this, ended = transfer.get()] {
    arrived_.push_back(ended->shared_from_this());
    changed_.notify();
  });
}

hal::Task<hal::Result<Bytes>> LibusbPipe::read() {
  if (handle_ == nullptr) co_return errc::make_error_code(errc::no_such_device);
  if (!std::exchange(reading_, true))
    for (std::size_t i = 0; i < kReads; ++i)
      if (const error_code error = start_read(std::make_shared<Transfer>())) co_return error;
  while (arrived_.empty()) co_await changed_.wait();
  const auto transfer = arrived_.front();
  arrived_.pop_front();
  if (const error_code error = usb_status(transfer->raw()->status)) co_return error;
  Bytes frame(transfer->bytes().begin(),
              transfer->bytes().begin() + transfer->raw()->actual_length);
  if (const error_code error = start_read(transfer)) co_return error;
  co_return frame;
}

// --- Finding an adapter.

struct Found {
  libusb_device* device{};
  std::string serial;
  std::string place;  // "1-2.3"
  std::string file;   // "/dev/bus/usb/001/004"
};

std::string place_of(libusb_device* device) {
  std::uint8_t ports[8];
  const int count = libusb_get_port_numbers(device, ports, sizeof ports);
  std::string place = std::to_string(libusb_get_bus_number(device));
  for (int i = 0; i < count; ++i) (place += i == 0 ? "-" : ".") += std::to_string(ports[i]);
  return place;
}

std::string three_digits(int number) {
  const std::string digits = std::to_string(number);
  return std::string(3 - std::min<std::size_t>(3, digits.size()), '0') + digits;
}

bool is_adapter(libusb_device* device) {
  libusb_device_descriptor descriptor{};
  if (libusb_get_device_descriptor(device, &descriptor) != 0) return false;
  return std::any_of(std::begin(kModels), std::end(kModels), [&](const Model& model) {
    return model.vendor == descriptor.idVendor && model.product == descriptor.idProduct;
  });
}

// The kernel has read the serial number already: no need to open the device for it.
Found describe(libusb_device* device) {
  Found found{device, "", place_of(device), ""};
  std::getline(std::ifstream("/sys/bus/usb/devices/" + found.place + "/serial"), found.serial);
  found.file = "/dev/bus/usb/" + three_digits(libusb_get_bus_number(device)) + "/" +
               three_digits(libusb_get_device_address(device));
  return found;
}

using DeviceList = std::unique_ptr<libusb_device*, void (*)(libusb_device**)>;

std::vector<Found> find_adapters(const DeviceList& list) {
  std::vector<Found> all;
  for (libusb_device** each = list.get(); each != nullptr && *each != nullptr; ++each)
    if (is_adapter(*each)) all.push_back(describe(*each));
  return all;
}

std::variant<Found, Trouble> choose(const std::vector<Found>& all, const std::string& serial) {
  std::string seen;
  std::vector<Found> fitting;
  for (const Found& each : all) {
    (seen += seen.empty() ? "" : ", ") += each.serial;
    if (serial == "any" || each.serial == serial) fitting.push_back(each);
  }
  if (fitting.size() == 1) return fitting[0];
  if (fitting.size() > 1)
    return trouble(LinkFault::bad_settings, "several gs_usb adapters: name one of " + seen);
  return trouble(LinkFault::absent, "gs_usb " + serial +
                                        (seen.empty() ? ": no adapter is plugged in"
                                                      : ": plugged in are only " + seen));
}

GsUsbAdapter::Opened open_adapter(const std::shared_ptr<UsbEvents>& events,
                                  const std::string& serial) {
  if (events->context() == nullptr)
    return trouble(
        LinkFault::no_driver,
        std::string("no USB here: ") + libusb_strerror(static_cast<libusb_error>(events->error())));
  libusb_device** raw = nullptr;
  if (libusb_get_device_list(events->context(), &raw) < 0)
    return trouble(LinkFault::no_driver, "USB devices cannot be listed");
  const DeviceList list(raw, [](libusb_device** devices) { libusb_free_device_list(devices, 1); });
  auto chosen = choose(find_adapters(list), serial);
  if (auto* why = std::get_if<Trouble>(&chosen)) return std::move(*why);
  const Found& found = std::get<Found>(chosen);
  libusb_device_handle* handle = nullptr;
  const std::string name = "gs_usb " + found.serial + " at " + found.place;
  if (const int code = libusb_open(found.device, &handle); code != 0)
    return trouble_of(usb_error(code), name, found.file);
  const auto pipe = std::make_shared<LibusbPipe>(events, handle, name);
  if (const error_code error = pipe->claim()) return trouble_of(error, name, found.file);
  return pipe;
}

}  // namespace

struct GsUsbBus::State {
  State(const boost::asio::any_io_executor& its_executor, hal::Clock& its_clock)
      : executor(its_executor), clock(its_clock), events(std::make_shared<UsbEvents>(executor)) {
    events->on_change([this] {
      for (auto& [serial, adapter] : adapters) adapter->look_again();
    });
  }

  ~State() { events->on_change(nullptr); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  boost::asio::any_io_executor executor;
  hal::Clock& clock;
  std::shared_ptr<UsbEvents> events;  // Adapters that still close keep it.
  std::map<std::string, std::unique_ptr<GsUsbAdapter>> adapters;
};

GsUsbBus::GsUsbBus(const boost::asio::any_io_executor& executor, hal::Clock& clock)
    : state_(std::make_shared<State>(executor, clock)) {}
GsUsbBus::~GsUsbBus() = default;

GsUsbAdapter::Channel& GsUsbBus::channel(const GsUsbAddress& address) {
  auto& adapter = state_->adapters[address.serial];
  if (!adapter) {
    auto open = [events = state_->events,
                 serial = address.serial]() -> hal::Task<GsUsbAdapter::Opened> {
      co_return open_adapter(events, serial);
    };
    adapter = std::make_unique<GsUsbAdapter>(std::move(open), state_->executor, state_->clock);
  }
  return adapter->channel(address.channel, address.bit_rate_bps, to_text(LinkAddress(address)));
}

}  // namespace drivers
