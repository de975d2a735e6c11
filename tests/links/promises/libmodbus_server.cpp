#include "tests/links/promises/libmodbus_server.hpp"

#include <arpa/inet.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <stdexcept>
#include <thread>

namespace links_test {
namespace {

constexpr int kSize = 200;

std::uint16_t port_of(int socket) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

bool readable(int socket) {
  pollfd wanted{socket, POLLIN, 0};
  return poll(&wanted, 1, 20) > 0;
}

}  // namespace

struct LibmodbusServer::State {
  State() {
    tables = modbus_mapping_new(kSize, kSize, kSize, kSize);
    for (int i = 0; i < kSize; ++i) {
      tables->tab_input_registers[i] = static_cast<std::uint16_t>(1000 + i);
      tables->tab_input_bits[i] = i % 3 == 0 ? 1 : 0;
    }
  }
  ~State() { modbus_mapping_free(tables); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void serve() {
    modbus_t* const context = modbus_new_tcp("127.0.0.1", port);
    while (!stopping) {
      if (!readable(listener)) continue;
      int accepted = listener;
      if (modbus_tcp_accept(context, &accepted) < 0) continue;
      answer(context);
      modbus_close(context);
    }
    modbus_free(context);
  }

  void answer(modbus_t* context) {
    std::uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    while (!stopping) {
      if (!readable(modbus_get_socket(context))) continue;
      const int size = modbus_receive(context, query);
      if (size < 0 || modbus_reply(context, query, size, tables) < 0) return;
    }
  }

  modbus_mapping_t* tables;
  int port = 0;
  int listener = -1;
  std::atomic<bool> stopping = false;
  std::thread thread;
};

LibmodbusServer::LibmodbusServer() : state_(std::make_unique<State>()) {
  start();
}
LibmodbusServer::~LibmodbusServer() {
  stop();
}

std::uint16_t LibmodbusServer::port() const {
  return static_cast<std::uint16_t>(state_->port);
}

void LibmodbusServer::start() {
  state_->listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  setsockopt(state_->listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port());
  if (bind(state_->listener, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
      listen(state_->listener, 4) != 0)
    throw std::runtime_error("cannot listen");
  state_->port = port_of(state_->listener);
  state_->stopping = false;
  state_->thread = std::thread([this] { state_->serve(); });
}

void LibmodbusServer::stop() {
  if (!state_->thread.joinable()) return;
  state_->stopping = true;
  state_->thread.join();
  close(state_->listener);
}

}  // namespace links_test
