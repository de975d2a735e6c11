// Lets coroutines wait for what another part of the program brings about.
#pragma once

#include <vector>

#include "hal/task.hpp"

namespace hal {

// For one event loop on one thread. Destroy it before the io_context: who still waits then is
// unwound.
class Wake {
 public:
  Wake() = default;
  ~Wake() { drop(); }
  Wake(const Wake&) = delete;
  Wake& operator=(const Wake&) = delete;

  // Until the next notify(); look again then at what you wait for. Throws
  // boost::system::system_error(operation_aborted) when cancelled.
  Task<void> wait();

  // Unwinds all who wait now, as destroying it does: for owners that live on in what they own.
  void drop();

  // Wakes all who wait now, in the order in which they came, after what is ready now.
  void notify();

 private:
  struct Waiter;
  template <class Handler>
  void enlist(Waiter& waiter, Handler handler);
  void cancel(Waiter* waiter);

  std::vector<Waiter*> waiters_, woken_;
};

}  // namespace hal
