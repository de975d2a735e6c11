// Instances are files from anywhere: any bytes give either costs that tours can be made of, or an
// error that names the file.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "planning/tour.hpp"
#include "tools/tsplib.hpp"

namespace {

constexpr std::size_t kSolvedNodesMax = 12;

void require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const tools::LoadedTsp loaded = tools::parse_tsp(text, "fuzz.tsp");
  for (const auto& error : loaded.errors) {
    require(error.text().starts_with("fuzz.tsp:"));
    require(error.line >= 0 && error.column >= 0 && !error.message.empty());
  }
  if (!loaded.errors.empty()) return 0;
  const planning::TourProblem& problem = loaded.tsp.problem;
  require(!problem.cost.empty());
  if (problem.cost.size() > kSolvedNodesMax) return 0;
  const planning::Tour tour = planning::solve_tour(problem);
  require(tour.order.size() + tour.unreachable.size() == problem.cost.size());
  return 0;
}
