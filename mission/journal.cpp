#include "mission/journal.hpp"

#include <sqlite3.h>

#include <utility>

namespace mission {
namespace {

namespace errc = boost::system::errc;

constexpr std::int64_t kApplication = 0x56544A31;  // "VTJ1": this file is a journal of ours.
constexpr std::int64_t kVersion = 1;

boost::system::error_code code_of(int result, int system) {
  switch (result & 0xFF) {
    case SQLITE_FULL:
      return make_error_code(errc::no_space_on_device);
    case SQLITE_BUSY:
      return make_error_code(errc::device_or_resource_busy);
    case SQLITE_NOMEM:
      return make_error_code(errc::not_enough_memory);
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return make_error_code(errc::bad_message);
    default:
      break;
  }
  if (system != 0) return {system, boost::system::system_category()};
  return make_error_code(errc::io_error);
}

using Statement = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

Statement prepared(sqlite3* db, const char* sql, int& result) {
  sqlite3_stmt* raw = nullptr;
  result = sqlite3_prepare_v2(db, sql, -1, &raw, nullptr);
  return {raw, &sqlite3_finalize};
}

// As it is stored: nothing is allocated that could be missing. No text is null.
std::string text_at(sqlite3_stmt* row, int column) {
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(row, column));
  return std::string(
      std::string_view(bytes, static_cast<std::size_t>(sqlite3_column_bytes(row, column))));
}

void bind_text(sqlite3_stmt* to, int place, const std::string& text) {
  sqlite3_bind_text64(to, place, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8);
}

}  // namespace

void JournalFile::Close::operator()(sqlite3* db) const {
  sqlite3_close(db);
}

FileError JournalFile::error(std::string doing, int result) const {
  const auto code = code_of(result, sqlite3_system_errno(db_.get()));
  const bool busy = code == make_error_code(errc::device_or_resource_busy);
  return {path_, std::move(doing), code,
          busy ? "another program has it open" : sqlite3_errmsg(db_.get())};
}

FileResult<JournalFile> JournalFile::open(const std::filesystem::path& path) {
  sqlite3* raw = nullptr;
  const int result =
      sqlite3_open_v2(path.c_str(), &raw,
                      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  JournalFile file(path, std::unique_ptr<sqlite3, Close>(raw));
  if (result != SQLITE_OK) return file.error("open", result);
  // SQLite would open it for reading, and then fail to lock it.
  if (sqlite3_db_readonly(raw, "main") == 1)
    return FileError{path, "write", make_error_code(errc::read_only_file_system)};
  sqlite3_extended_result_codes(raw, 1);
  const auto ready = file.prepare();
  if (!ready) return ready.error();
  return file;
}

FileResult<void> JournalFile::run(const char* sql) const {
  const int result = sqlite3_exec(db_.get(), sql, nullptr, nullptr, nullptr);
  if (result != SQLITE_OK) return error("write", result);
  return {};
}

FileResult<std::int64_t> JournalFile::number(const char* sql) const {
  int result = SQLITE_OK;
  const Statement statement = prepared(db_.get(), sql, result);
  if (result == SQLITE_OK) result = sqlite3_step(statement.get());
  if (result != SQLITE_ROW) return error("read", result);
  return std::int64_t{sqlite3_column_int64(statement.get(), 0)};
}

// Exclusive: nobody else writes, and no shared memory is needed. What is not ours is only read.
FileResult<void> JournalFile::prepare() {
  if (const auto done = run("PRAGMA locking_mode=EXCLUSIVE"); !done) return done;
  const auto fresh = is_new();
  if (!fresh) return fresh.error();
  for (const char* setting :
       {"PRAGMA journal_mode=WAL", "PRAGMA synchronous=FULL", "BEGIN IMMEDIATE", "COMMIT"})
    if (const auto done = run(setting); !done) return done;
  if (*fresh) {
    const std::string make =
        "BEGIN; CREATE TABLE events (number INTEGER PRIMARY KEY, at_ns INTEGER NOT NULL, kind TEXT "
        "NOT NULL, text TEXT NOT NULL) STRICT; PRAGMA application_id=" +
        std::to_string(kApplication) + "; PRAGMA user_version=" + std::to_string(kVersion) +
        "; COMMIT";
    if (const auto done = run(make.c_str()); !done) return done;
  }
  if (const auto sound = check(); !sound) return sound;
  const auto last = number("SELECT ifnull(max(number), 0) FROM events");
  if (!last) return last.error();
  last_ = *last;
  return {};
}

FileError JournalFile::refuse(errc::errc_t why, const char* detail) const {
  return {path_, "use", make_error_code(why), detail};
}

// Whether there is nothing in it yet.
FileResult<bool> JournalFile::is_new() const {
  const auto application = number("PRAGMA application_id"), version = number("PRAGMA user_version"),
             tables = number("SELECT count(*) FROM sqlite_master");
  for (const auto* each : {&application, &version, &tables})
    if (!*each) return each->error();
  if (*application == kApplication && *version > kVersion)
    return refuse(errc::not_supported, "a later version made it");
  const bool fresh = *application == 0 && *version == 0 && *tables == 0;
  if (!fresh && *application != kApplication) return refuse(errc::bad_message, "it is no journal");
  return fresh;
}

// Whole, and without gaps.
FileResult<void> JournalFile::check() const {
  const auto sound = number("SELECT count(*) FROM pragma_quick_check WHERE quick_check != 'ok'");
  if (!sound) return sound.error();
  const auto missing = number("SELECT ifnull(max(number), 0) - count(*) FROM events");
  if (!missing) return missing.error();
  if (*sound != 0 || *missing != 0) return refuse(errc::bad_message, "it is damaged");
  return {};
}

FileResult<void> JournalFile::append(std::span<JournalEvent> events) {
  if (const auto begun = run("BEGIN IMMEDIATE"); !begun) return begun;
  auto done = insert(events);
  if (done) done = run("COMMIT");
  if (!done) {
    (void)run("ROLLBACK");  // Some errors have done that already.
    return done;
  }
  last_ += static_cast<std::int64_t>(events.size());
  return {};
}

FileResult<void> JournalFile::insert(std::span<JournalEvent> events) {
  int result = SQLITE_OK;
  const Statement statement =
      prepared(db_.get(), "INSERT INTO events VALUES (?1, ?2, ?3, ?4)", result);
  if (result != SQLITE_OK) return error("write", result);
  std::int64_t number = last_;
  for (JournalEvent& event : events) {
    event.number = ++number;
    sqlite3_bind_int64(statement.get(), 1, event.number);
    sqlite3_bind_int64(statement.get(), 2, event.at.time_since_epoch().count());
    bind_text(statement.get(), 3, event.kind);
    bind_text(statement.get(), 4, event.text);
    result = sqlite3_step(statement.get());
    if (result != SQLITE_DONE) return error("write", result);
    sqlite3_reset(statement.get());
  }
  return {};
}

FileResult<std::vector<JournalEvent>> JournalFile::read() const {
  int result = SQLITE_OK;
  const Statement statement =
      prepared(db_.get(), "SELECT number, at_ns, kind, text FROM events ORDER BY number", result);
  if (result != SQLITE_OK) return error("read", result);
  std::vector<JournalEvent> events;
  while ((result = sqlite3_step(statement.get())) == SQLITE_ROW)
    events.push_back({sqlite3_column_int64(statement.get(), 0),
                      hal::Time(hal::Duration(sqlite3_column_int64(statement.get(), 1))),
                      text_at(statement.get(), 2), text_at(statement.get(), 3)});
  if (result != SQLITE_DONE) return error("read", result);
  return events;
}

hal::Task<void> Journal::run() {
  for (;;) {
    while (waiting_.empty() && again_.empty()) co_await came_.wait();
    const hal::Time began = clock_.now();
    co_await write(taken());
    went_.notify();
    co_await clock_.sleep_until(began + (trouble_ ? kAgain : kPause));
  }
}

std::deque<std::shared_ptr<Journal::Waiting>> Journal::taken() {
  auto batch = std::exchange(again_, {});
  for (auto& each : std::exchange(waiting_, {})) batch.push_back(std::move(each));
  return batch;
}

hal::Task<void> Journal::write(std::deque<std::shared_ptr<Waiting>> batch) {
  std::vector<JournalEvent> events;
  for (const auto& each : batch) events.push_back(each->event);
  FileResult<void> outcome;
  const auto work = [&] { outcome = file_.append(events); };
  co_await compute_.run(work);
  ++commits_;
  if (!outcome) {
    trouble_ = outcome.error();
    again_ = std::move(batch);
    co_return;
  }
  trouble_.reset();
  for (std::size_t i = 0; i < batch.size(); ++i) {
    batch[i]->event.number = events[i].number;
    batch[i]->done = true;
  }
}

void Journal::tell(std::string kind, std::string text) {
  if (waiting_.size() + again_.size() >= kToldMax) return;
  const auto mine = std::make_shared<Waiting>();
  mine->event = {0, clock_.now(), std::move(kind), std::move(text)};
  waiting_.push_back(mine);
  came_.notify();
}

FileResult<void> Journal::append_now(std::string kind, std::string text) {
  std::vector<JournalEvent> events;
  for (const auto& each : taken()) events.push_back(std::move(each->event));
  events.push_back({0, clock_.now(), std::move(kind), std::move(text)});
  ++commits_;
  return file_.append(events);
}

hal::Task<std::int64_t> Journal::append(std::string kind, std::string text) {
  while (waiting_.size() >= kWaitingMax) co_await went_.wait();
  const auto mine = std::make_shared<Waiting>();
  mine->event = {0, clock_.now(), std::move(kind), std::move(text)};
  waiting_.push_back(mine);
  came_.notify();
  while (!mine->done) co_await went_.wait();
  co_return mine->event.number;
}

}  // namespace mission
