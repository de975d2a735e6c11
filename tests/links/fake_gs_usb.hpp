// The simulated gs_usb adapter behind the same seam as libusb.
#pragma once

#include <memory>

#include "drivers/gs_usb_adapter.hpp"
#include "hal/wake.hpp"
#include "sim/gs_usb_unit.hpp"

namespace links_test {

class FakeGsUsb {
 public:
  FakeGsUsb();
  ~FakeGsUsb();
  FakeGsUsb(const FakeGsUsb&) = delete;
  FakeGsUsb& operator=(const FakeGsUsb&) = delete;

  drivers::GsUsbAdapter::Open open();
  void unplug();
  void plug_in();
  void silence(bool on);  // Nobody acknowledges: frames wait in their channel.
  void go_bus_off(std::uint8_t channel);
  void go_passive(std::uint8_t channel);
  void hear(std::uint8_t channel, const hal::CanFrame& frame, bool overflow);  // From the bus.
  void keep_stale(const hal::CanFrame& frame);  // Still in its buffers when it is opened next.
  // Call n from now on fails once, as a stalled request or a broken transfer does.
  void fail_call(int n);
  int starts(std::uint8_t channel) const;

 private:
  struct State;
  class Pipe;
  std::shared_ptr<State> state_;
};

}  // namespace links_test
