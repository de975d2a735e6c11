// libusb on the event loop: its descriptors are waited for with everything else.
#pragma once

#include <libusb.h>

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>

#include "drivers/bytes.hpp"
#include "hal/links.hpp"

namespace drivers {

class UsbEvents {
 public:
  explicit UsbEvents(const boost::asio::any_io_executor& executor);
  ~UsbEvents();
  UsbEvents(const UsbEvents&) = delete;
  UsbEvents& operator=(const UsbEvents&) = delete;

  libusb_context* context() const { return context_; }  // Null: there is no USB here, see error().
  int error() const { return error_; }
  // Handles what is ready, without waiting.
  void handle();
  // Calls it whenever a device comes or goes, where libusb can tell. Null: tell nobody any more.
  void on_change(std::function<void()> changed);

 private:
  struct Descriptors;
  libusb_context* context_ = nullptr;
  int error_ = 0;
  std::shared_ptr<Descriptors> descriptors_;
  std::function<void()> changed_;
  libusb_hotplug_callback_handle hotplug_{};
  bool has_hotplug_ = false;
};

// LIBUSB_ERROR_... or a transfer's status as error codes.
boost::system::error_code usb_error(int code);
boost::system::error_code usb_status(libusb_transfer_status status);

}  // namespace drivers
