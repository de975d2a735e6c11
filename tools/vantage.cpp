// vantage: the person's command line, without the robot. Each command has a file of its own.
#include <cstdio>

#include "tools/vantage_command.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Helps to plan surveys: checks missions, previews plans, rehearses, explains."};
  app.footer(
      "Examples:\n"
      "  vantage check configs/missions/fort.toml\n"
      "  vantage plan --site path/to/folder --svg plan.svg\n"
      "  vantage rehearse configs/missions/church.toml --save plan.toml\n"
      "  vantage nbv --mission configs/missions/fort.toml --map runs/fort\n"
      "  vantage cover configs/missions/fort.toml\n"
      "  vantage tour pcb442.tsp --json\n"
      "  vantage keys | less\n"
      "  vantage decode agilex drive.log\n"
      "  vantage doctor configs/robots/scout_lms511.toml\n"
      "  vantage register scan1.ply scan2.ply\n"
      "  vantage localize --odometry wheels.csv --gnss rover.ubx --out way.tum\n"
      "  vantage explain F012\n"
      "  vantage route --site path/to/folder --from 0,0 --to 12,-8\n"
      "  vantage resume runs/fort\n"
      "  vantage console\n"
      "Each command has its own --help, with examples. Every command but console knows --json.\n"
      "Exit: 0 fine, 1 tried and failed, 2 refused (every reason is on stderr, one a line).");
  app.require_subcommand(1);
  vantage::Run run;
  vantage::add_check_command(app, run);
  vantage::add_keys_command(app, run);
  vantage::add_plan_command(app, run);
  vantage::add_rehearse_command(app, run);
  vantage::add_nbv_command(app, run);
  vantage::add_why_command(app, run);
  vantage::add_slice_command(app, run);
  vantage::add_cover_command(app, run);
  vantage::add_tour_command(app, run);
  vantage::add_decode_command(app, run);
  vantage::add_doctor_command(app, run);
  vantage::add_register_command(app, run);
  vantage::add_localize_command(app, run);
  vantage::add_explain_command(app, run);
  vantage::add_route_command(app, run);
  vantage::add_console_command(app, run);
  vantage::add_resume_command(app, run);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? vantage::kFine : vantage::kRefused;
  }
  return run();
}
