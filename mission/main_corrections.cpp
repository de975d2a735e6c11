#include "mission/main_corrections.hpp"

#include <variant>

#include "drivers/link_address.hpp"

namespace mission {

drivers::NtripRequest ntrip_request_of(const CorrectionsConfig& config, const Account& account) {
  const auto parsed = drivers::parse_link_address(config.link);
  drivers::NtripRequest request;
  if (const auto* link = std::get_if<drivers::LinkAddress>(&parsed))
    if (const auto* tcp = std::get_if<drivers::TcpAddress>(link)) {
      request.host = tcp->host;
      request.port = tcp->port;
    }
  request.mountpoint = config.mountpoint;
  request.user = account.user;
  request.password = account.password;
  request.version = config.version == 1 ? drivers::NtripVersion::v1 : drivers::NtripVersion::v2;
  return request;
}

CorrectionsProblem corrections_problem(const RobotConfig& robot) {
  if (!has_corrections(robot)) return {};
  if (robot.gnss.device != "ublox")
    return {"corrections.device",
            "only a receiver of [gnss] device = \"ublox\" is given corrections: others must get "
            "them by themselves; leave out [corrections]"};
  const drivers::NtripRequest request = ntrip_request_of(robot.corrections, {});
  if (request.host.empty())
    return {"corrections.link", "a caster is at tcp:HOST:PORT, such as tcp:rtk.example.org:2101"};
  const std::string problem = drivers::ntrip_request_problem(request);
  return problem.empty() ? CorrectionsProblem{}
                         : CorrectionsProblem{"corrections.mountpoint", problem};
}

}  // namespace mission
