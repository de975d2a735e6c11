// A Modbus TCP server that is not ours, on a thread: libmodbus's, with the tables of TableUnit.
#pragma once

#include <cstdint>
#include <memory>

namespace links_test {

class LibmodbusServer {
 public:
  LibmodbusServer();  // Listens on a free port of 127.0.0.1.
  ~LibmodbusServer();
  LibmodbusServer(const LibmodbusServer&) = delete;
  LibmodbusServer& operator=(const LibmodbusServer&) = delete;

  std::uint16_t port() const;
  void start();  // On the same port again.
  void stop();   // Closes everything.

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace links_test
