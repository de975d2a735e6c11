#include "drivers/usb_events.hpp"

#include <poll.h>

#include <boost/asio/posix/stream_descriptor.hpp>
#include <map>
#include <utility>

namespace drivers {
namespace {

namespace errc = boost::system::errc;
using boost::asio::posix::stream_descriptor;
using boost::system::error_code;

struct Pair {
  int code;
  errc::errc_t error;
};
constexpr Pair kErrors[] = {
    {LIBUSB_ERROR_ACCESS, errc::permission_denied},
    {LIBUSB_ERROR_NO_DEVICE, errc::no_such_device},
    {LIBUSB_ERROR_NOT_FOUND, errc::no_such_device},
    {LIBUSB_ERROR_BUSY, errc::device_or_resource_busy},
    {LIBUSB_ERROR_TIMEOUT, errc::timed_out},
    {LIBUSB_ERROR_PIPE, errc::not_supported},
    {LIBUSB_ERROR_NOT_SUPPORTED, errc::not_supported},
    {LIBUSB_ERROR_NO_MEM, errc::not_enough_memory},
    {LIBUSB_ERROR_INVALID_PARAM, errc::invalid_argument},
};

}  // namespace

error_code usb_error(int code) {
  if (code >= 0) return {};
  for (const Pair& pair : kErrors)
    if (pair.code == code) return errc::make_error_code(pair.error);
  return errc::make_error_code(errc::io_error);
}

error_code usb_status(libusb_transfer_status status) {
  switch (status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return {};
    case LIBUSB_TRANSFER_TIMED_OUT:
      return errc::make_error_code(errc::timed_out);
    case LIBUSB_TRANSFER_STALL:
      return errc::make_error_code(errc::not_supported);
    case LIBUSB_TRANSFER_NO_DEVICE:
      return errc::make_error_code(errc::no_such_device);
    case LIBUSB_TRANSFER_CANCELLED:
      return errc::make_error_code(errc::operation_canceled);
    default:
      return errc::make_error_code(errc::io_error);
  }
}

// What libusb wants to be watched. Shared with the waits that are under way.
struct UsbEvents::Descriptors : std::enable_shared_from_this<Descriptors> {
  Descriptors(const boost::asio::any_io_executor& its_executor, UsbEvents& its_events)
      : executor(its_executor), events(&its_events) {}

  void add(int fd, short wanted) {
    remove(fd);
    const auto descriptor = std::make_shared<stream_descriptor>(executor, fd);
    watched.emplace(fd, descriptor);
    if ((wanted & POLLIN) != 0) wait(descriptor, stream_descriptor::wait_read);
    if ((wanted & POLLOUT) != 0) wait(descriptor, stream_descriptor::wait_write);
  }

  void remove(int fd) {
    const auto found = watched.find(fd);
    if (found == watched.end()) return;
    found->second->release();  // It is libusb's to close.
    watched.erase(found);
  }

  void wait(const std::shared_ptr<stream_descriptor>& descriptor,
            stream_descriptor::wait_type type) {
    descriptor->async_wait(type, [self = shared_from_this(), descriptor, type](error_code error) {
      if (error || self->events == nullptr || !descriptor->is_open()) return;
      self->events->handle();
      if (self->events != nullptr && descriptor->is_open()) self->wait(descriptor, type);
    });
  }

  void clear() {
    events = nullptr;
    while (!watched.empty()) remove(watched.begin()->first);
  }

  boost::asio::any_io_executor executor;
  UsbEvents* events;  // Null when they are gone.
  std::map<int, std::shared_ptr<stream_descriptor>> watched;
};

UsbEvents::UsbEvents(const boost::asio::any_io_executor& executor)
    : descriptors_(std::make_shared<Descriptors>(executor, *this)) {
  error_ = libusb_init(&context_);
  if (error_ != 0) {
    context_ = nullptr;
    return;
  }
  libusb_set_pollfd_notifiers(
      context_,
      [](int fd, short wanted, void* self) { static_cast<Descriptors*>(self)->add(fd, wanted); },
      [](int fd, void* self) { static_cast<Descriptors*>(self)->remove(fd); }, descriptors_.get());
  const libusb_pollfd** const list = libusb_get_pollfds(context_);
  for (auto each = list; each != nullptr && *each != nullptr; ++each)
    descriptors_->add((*each)->fd, (*each)->events);
  libusb_free_pollfds(list);
}

UsbEvents::~UsbEvents() {
  if (has_hotplug_) libusb_hotplug_deregister_callback(context_, hotplug_);
  if (context_ != nullptr) libusb_set_pollfd_notifiers(context_, nullptr, nullptr, nullptr);
  descriptors_->clear();
  if (context_ != nullptr) libusb_exit(context_);
}

void UsbEvents::handle() {
  timeval none{};
  libusb_handle_events_timeout_completed(context_, &none, nullptr);
}

void UsbEvents::on_change(std::function<void()> changed) {
  changed_ = std::move(changed);
  if (context_ == nullptr || has_hotplug_ || !changed_ ||
      libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) == 0)
    return;
  has_hotplug_ =
      libusb_hotplug_register_callback(
          context_, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT, 0,
          LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY,
          [](libusb_context*, libusb_device*, libusb_hotplug_event, void* self) {
            if (const auto& tell = static_cast<UsbEvents*>(self)->changed_) tell();
            return 0;
          },
          this, &hotplug_) == LIBUSB_SUCCESS;
}

}  // namespace drivers
