// A mission on hardware and the service that carries it out: who must go on when, what a reload
// finds. Like main.cpp it may know everything.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <functional>

#include "mission/main_hardware.hpp"
#include "mission/main_service.hpp"
#include "mission/main_worker.hpp"

namespace mission {

class Serving {
 public:
  // Everything must outlive it. `prepare_again` reads the mission's files anew (on a thread).
  Serving(Service& service, const Prepared& prepared, std::function<Prepared()> prepare_again,
          boost::asio::io_context& io);

  // What the mission's parts are made with.
  void configure(GuardedSurvey::Config& config) const;
  Worker::Config worker() const;

  // The devices are being looked for. From here on SIGHUP checks the config.
  void begin();
  // The mission is over and its loop ends: what is left is to write its products.
  void end();

 private:
  void step(MissionStep step) const;
  hal::Task<void> tick();
  void wait_for_reload();
  hal::Task<void> reload();

  Service& service_;
  const Prepared& prepared_;
  const std::function<Prepared()> prepare_again_;
  boost::asio::io_context& io_;
  const hal::Duration scan_bound_;
  boost::asio::signal_set reload_;
  Worker checks_;  // Apart from the mission's: it must not wait for a plan.
};

}  // namespace mission
