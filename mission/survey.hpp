// The mission as the paper tells it, top to bottom: plan the stations, tour them, then take next
// best views until none would add enough.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/angles.hpp"
#include "hal/clock.hpp"
#include "hal/compute.hpp"
#include "hal/devices.hpp"
#include "mission/config.hpp"
#include "mission/disk_watch.hpp"
#include "mission/energy.hpp"
#include "mission/map_match.hpp"
#include "mission/pilot.hpp"
#include "mission/plan.hpp"
#include "mission/ply.hpp"
#include "mission/progress.hpp"
#include "mission/record.hpp"
#include "mission/run_history.hpp"
#include "mission/scan_registrar.hpp"
#include "mission/site_model.hpp"
#include "mission/store.hpp"
#include "mission/surroundings.hpp"
#include "mission/survey_orders.hpp"
#include "mission/walls_so_far.hpp"
#include "planning/replacement.hpp"

namespace mission {

// The survey cannot go on; what() says why, in words for the operator.
struct CannotGoOn : std::runtime_error {
  using runtime_error::runtime_error;
};

class Survey {
 public:
  // 1 sigma of the heading beyond which the robot stands.
  static constexpr double kHeadingSigmaMaxRad = 15 * hal::kDeg;

  // In simulation: where the robot really is, and where its last scan was really taken.
  struct Truths {
    hal::Pose2 robot;
    double ground_z_m{};
    std::optional<hal::Pose2> scan;
  };
  // What a survey needs; everything outlives it.
  struct Parts {
    hal::Clock& clock;
    hal::Devices& devices;
    RunStore& store;
    ProgressPrinter& progress;
    hal::Compute& compute;             // Plans, while the robot stands and its devices are served.
    Journal* journal = nullptr;        // Null: nobody can go on with it after a cut.
    const RunHistory* past = nullptr;  // The run to go on with; null: a new one.
    std::vector<std::string> skip = {};  // Stations to be left out, by name.
    std::function<Truths()> truths = {};
  };

  Survey(const MissionConfig& config, const nav::SiteMap& map, SiteTasks tasks, int threads,
         Parts parts);

  // Device failures that a survey cannot work around throw std::runtime_error; the record then says
  // how far it came, and why no farther. Cancelled, it ends as soon as what it computes is
  // computed.
  hal::Task<void> run();
  // What the record gives as the end of a survey that is cancelled next.
  void stop_because(std::string reason) { stop_reason_ = std::move(reason); }

  const RunRecord& record() const { return record_; }
  RunRecord& record() { return record_; }
  const SiteModel& model() const { return *model_; }
  const CloudMerger& cloud() const { return cloud_; }
  // What a person orders of it.
  SurveyOrders& orders() { return orders_; }
  const Pilot& pilot() const { return pilot_; }
  // For the gate; does not allocate.
  Surroundings surroundings();
  // Why the disk does not take what has to be kept; the robot is to stand then. Nothing: it does,
  // or the robot goes home for it. Does not allocate.
  std::optional<FaultCode> disk_fault() const {
    return goes_home_for_disk() ? std::nullopt : disk_.fault();
  }
  bool goes_home_for_disk() const { return disk_.goes_home(); }
  const DiskWatch& disk() const { return disk_; }
  const std::optional<Progress>& shown() const { return shown_; }  // The latest; nothing: none yet.

 private:
  // Where the next scan is to be taken, and why.
  struct Stop {
    std::string name;
    int task{};
    hal::Pose2 pose;
    const planning::Station* station{};  // Phase I
    const NextView* view{};              // Phase II
  };

  hal::Task<void> survey();
  hal::Task<void> survey_site();
  hal::Task<void> look_around();
  hal::Task<void> beside();
  hal::Task<void> plan_stations();
  void take_plans(std::vector<PlannedArea> planned);
  hal::Task<void> tour(std::size_t task);
  hal::Task<void> refine();
  hal::Task<bool> go_home(bool ordered);
  std::string why_no_scan() const;
  // In survey_journal.cpp.
  hal::Task<void> keep(EventText event);
  void tell(EventText event);
  hal::Task<void> keep_plan();
  hal::Task<void> keep_scan(const Stop& stop);
  hal::Task<void> keep_closing(bool moved);
  void tell_leg(const Stop& stop, const LegEnd& leg);
  void tell_drop(const Stop& stop);
  hal::Task<void> tell_places();
  hal::Task<void> follow(const Stop& stop, LegEnd& leg);
  bool keep_end();
  void note_end();
  RunPlanned planned() const;
  SoFar so_far() const;
  Whereabouts whereabouts() const;
  // In survey_disk.cpp.
  hal::Task<void> until_written(std::function<void()> work);
  hal::Task<void> until_decided();
  hal::Task<void> watch_disk();
  void heed_disk();
  void note_disk(DiskWatch::Part part, const FileError* why);
  void say_disk(const std::string& what);
  hal::Task<void> until_sent_home();
  hal::Task<void> home_without_disk();
  hal::Task<void> wait_at_home(std::string& why_not_there);
  hal::Task<void> try_disk();
  void uncount_last_scan(bool journal_is_whole);
  // In survey_resume.cpp.
  hal::Task<void> take_up();
  void redo();
  void redo(const LegDone& leg);
  void redo(const ScanDone& done);
  void redo(const TourClosed& closed);
  void redo(const StationDropped& dropped);
  void redo(const ViewsLeftOut& left_out);
  void mend_scans();
  void tour_the_rest();
  bool keeps_beams() const;
  void note_box();
  void note_gnss();
  void note_moving();
  void note_ground();
  void note_leg(const LegEnd& leg);
  void redo(const StationReplaced& replaced);
  // In survey_replace.cpp.
  hal::Task<void> replace(std::size_t task, int dropped);
  planning::Replacements find_instead(std::size_t task, int dropped,
                                      const Eigen::Vector2d& here_m) const;
  std::vector<std::vector<planning::WallPiece>> walls_kept(std::size_t task) const;
  void add_station(std::size_t task, std::string name, planning::Station station);
  void note_instead(const StationReplaced& replaced);
  // In survey_energy.cpp.
  double way_s(const hal::Pose2& from, const hal::Pose2& to) const;
  std::vector<double> legs_ahead_s(const Stop& stop);
  bool affords(const Stop& stop);
  void note_forecasts();
  void note_energy();

  // In survey_ordered.cpp.
  hal::Task<bool> visit(const Stop& stop);
  hal::Task<void> visit_into(const Stop& stop, bool& done);
  hal::Task<bool> finished(hal::Task<void> step);
  hal::Task<void> obey();
  hal::Task<void> run_errand(const SurveyOrders::Order& errand);
  hal::Task<void> errand_into(const Stop& stop, bool scans, bool& done);
  hal::Task<void> wait_for_orders();
  hal::Task<void> leave_for_home();
  hal::Task<void> retour(std::size_t task, std::size_t done);
  void note_given();
  void tell(const std::string& what);

  hal::Task<bool> visit_now(const Stop& stop);
  hal::Task<bool> drive(const Stop& stop, ScanRecord& scan);
  hal::Task<bool> carry(const Stop& stop, ScanRecord& scan);
  // In survey_scan.cpp.
  hal::Task<bool> acquire(const Stop& stop, ScanRecord scan);
  void look_for_room();
  hal::Task<std::optional<hal::ScanCloud>> take_scan(const Stop& stop);
  // What is on the disk of a scan.
  struct Saved {
    std::uint64_t beams_checksum{};
    std::vector<Eigen::Vector3f> W_points_m;
  };
  hal::Task<void> save(const hal::ScanCloud& cloud, const ScanRecord& scan, Saved& saved);
  void merge(const hal::ScanCloud& cloud, const Saved& saved, const Stop& stop, ScanRecord& scan);
  void save_points(const ScanRecord& scan, const std::vector<Eigen::Vector3f>& W_points_m,
                   const Eigen::Isometry3d& T_W_S);
  ScanEffect insert(const hal::ScanCloud& cloud, const std::vector<Eigen::Vector3f>& W_points_m,
                    const Eigen::Isometry3d& T_W_S, const Stop& stop, ScanRecord& scan);
  void close_roads(int scan, const ScanEffect& effect);

  // In survey_register.cpp.
  ScanBelief note_pose(ScanRecord& scan) const;
  enum class MapSays { nothing, here, elsewhere };  // Of where a scan was taken.
  hal::Task<MapSays> match_map(const hal::ScanCloud& cloud, const ScanRecord& scan);
  void note_sensors();
  void register_scan(const hal::ScanCloud& cloud, const ScanBelief& belief, ScanRecord& scan,
                     MapSays map, bool last);
  void try_to_register(const ScanBelief& belief, ScanRecord& scan, bool other_guesses);
  void tell_localizer(const ScanRecord& scan);
  hal::Task<void> know_walls();
  static std::string refused_note(const ScanRecord& scan);
  void note_verdict(const ScanRecord& scan, bool again);
  hal::Task<void> close_tour();
  bool fit_tour();
  void fill_anew(bool save);
  void note_registration();

  std::vector<NextView> choose_views();
  std::optional<std::size_t> choose_view(std::vector<NextView>& views,
                                         const Eigen::Vector2d& from_m, ViewsLeftOut& left_out);
  void leave_out(std::vector<NextView>& views, const Eigen::Vector2d& from_m,
                 ViewsLeftOut& left_out);
  void bring_back();
  bool count_again();
  bool open_roads();
  std::string why_no_view() const;
  void note_left_out();
  hal::Task<bool> take_best_of(std::vector<NextView>& views);
  hal::Task<void> leave(std::string reason, bool stopped_for_gain);
  void note_leftover(bool stopped_for_gain);
  void drop(const Stop& stop, const std::string& reason);
  void decide(const boost::json::object& decision);
  void show(const Stop& stop);
  double now_s() const { return before_s_ + hal::seconds(parts_.clock.now() - began_); }
  const AreaTask& task(int index) const { return tasks_.tasks[static_cast<std::size_t>(index)]; }

  const MissionConfig config_;
  const nav::SiteMap& map_;
  const SiteTasks tasks_;
  const int threads_;
  Parts parts_;
  const hal::Time began_;
  double before_s_{};  // Mission time of what went before, when it goes on with a run.
  std::string stop_reason_;
  SurveyOrders orders_;
  DiskWatch disk_;
  hal::Wake sent_home_;      // By the disk,
  std::string disk_why_;     // for that reason.
  bool keeps_scan_ = false;  // The last scan counts only when the journal has taken its event,
  bool told_scan_ = false;   // which it was given.
  Pilot pilot_;
  std::unique_ptr<SiteModel> model_;
  std::unique_ptr<MapMatcher> matcher_;  // Null: not asked for.
  std::optional<WallsSoFar> walls_;      // Nothing: the robot does not look ahead.
  ScanRegistrar registrar_;
  ScanAttempt attempt_;                         // Of the scan that is being registered.
  std::vector<std::uint64_t> beams_checksums_;  // Of the scans kept, where keeps_beams().
  int scans_closed_{};                          // In the map as the last closed tour has them.
  int last_by_robot_ = -1;                      // Index of a scan,
  double last_by_robot_at_m_{};                 // and the way travelled until then.
  int layers_at_first_{};                       // Of its voxel box.
  std::vector<Roads> roads_;                    // One per planned task, in order.
  std::vector<std::size_t> dealt_with_;         // Stations of each planned task's tour.
  std::size_t stations_planned_{};
  std::size_t stations_done_{};
  int views_taken_{};
  int stops_without_scan_{};  // In a row.
  double covered_m_{};
  double target_m_{};
  EnergyBook energy_;
  std::vector<double> tour_legs_s_;  // Drives from station to station of the robot's tour.
  std::size_t tours_next_{};         // Station of it after the one that is next.
  bool battery_low_{};               // For the last stop that was thought of.
  bool put_off_{};  // The stop was not visited: the stations left get a new order first.
  bool no_way_{};   // The stop was dropped because no road leads there any more.
  std::vector<NextView> left_out_;      // No road led there,
  int left_out_at_{};                   // when roads had opened so often,
  bool left_out_now_{};                 // since the last look for views.
  std::set<std::string> replacements_;  // Names of stations in place of others.
  std::optional<Progress> shown_;
  Eigen::Vector2d zone_at_m_{0, 0};  // Where the zone was looked up last.
  std::optional<double> zone_speed_mps_;
  CloudMerger cloud_;
  RunRecord record_;
};

// A person wants the robot home, now. what() is for the record.
struct OrderedHome : std::runtime_error {
  using runtime_error::runtime_error;
};

}  // namespace mission
