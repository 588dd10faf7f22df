#include "server/audit/audit_trail.hpp"

#include <algorithm>
#include <utility>

#include "common/runtime/log.hpp"

namespace osteon {
namespace {

constexpr std::size_t kMostAtOnce = 256;  // records of one write
constexpr std::chrono::hours kMaintainEvery{24};

void shorten(std::string& text) {
  if (text.size() > kMostText) text.resize(kMostText);
}

// The certificate says who it is, and the authority signed it.
bool is_known(const AuditIdentity& who) { return !who.person.empty() && !who.person.starts_with(kClaimed); }

}  // namespace

AuditTrail::AuditTrail(AuditOptions options, AuditLog log)
    : options_(std::move(options)),
      log_(std::move(log)),
      syslog_(options_.syslog),
      window_ends_(Clock::now() + options_.window) {}

Result<std::unique_ptr<AuditTrail>> AuditTrail::open(AuditOptions options, Disk* disk) {
  auto log =
      AuditLog::open(disk != nullptr ? *disk : system_disk(), options.file, options.keys, AuditLog::Unfit::set_aside);
  if (!log) return tl::unexpected(log.error());
  std::unique_ptr<AuditTrail> trail(new AuditTrail(std::move(options), std::move(*log)));
  // Written at once, so that a server whose log cannot be written does not start.
  trail->batch_.push_back({.action = "start", .result = kOk});
  auto written = trail->log_.append(trail->batch_);
  if (!written) return tl::unexpected(written.error());
  trail->send_to_syslog(*written);
  trail->maintain();
  trail->thread_ = std::thread([raw = trail.get()] { raw->run(); });
  return trail;
}

AuditTrail::~AuditTrail() {
  if (!thread_.joinable()) return;
  {
    const MutexLock lock(mutex_);
    end_window();
    put({.action = "stop", .result = kOk}, options_.most_waiting + 1);
    end_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

AuditCounts AuditTrail::counts() const {
  const MutexLock lock(mutex_);
  return counts_;
}

void AuditTrail::record(AuditEvent event) {
  for (std::string* text : {&event.who.person, &event.who.certificate, &event.who.ticket, &event.who.address,
                            &event.action, &event.object, &event.result, &event.detail})
    shorten(*text);
  const bool is_refusal = event.result == kRefused;
  {
    const MutexLock lock(mutex_);
    if (end_ || (is_refusal && is_counted(event))) return;
    put(std::move(event), is_refusal ? options_.most_waiting / 2 : options_.most_waiting);
  }
  wake_.notify_all();
}

bool AuditTrail::is_counted(const AuditEvent& event) {
  const bool known = is_known(event.who);
  Refusals& of = refusals_[known ? event.who.person : ""];
  std::tuple key(event.who, event.action, event.object, event.detail);
  if (const auto seen = of.seen.find(key); seen != of.seen.end()) {
    ++seen->second.times;
    return true;
  }
  if (of.seen.size() >= (known ? kMostOfOne : kMostOfUnauthenticated)) {
    ++of.omitted;
    return true;
  }
  of.seen.emplace(std::move(key), Refusals::Repeated{event, 0});
  return false;
}

void AuditTrail::put(AuditEvent event, std::size_t most) {
  if (waiting_.size() < most) {
    waiting_.push_back(std::move(event));
    return;
  }
  ++lost_;
  ++counts_.lost;
}

void AuditTrail::end_window() {
  window_ends_ = Clock::now() + options_.window;
  for (auto& [person, of] : std::exchange(refusals_, {})) {
    for (auto& [key, repeated] : of.seen) {
      if (repeated.times == 0) continue;
      repeated.event.at = std::chrono::system_clock::now();
      repeated.event.detail += ", " + std::to_string(repeated.times) + " times more";
      put(std::move(repeated.event), options_.most_waiting);
    }
    if (of.omitted > 0)
      put({.who = {.person = person},
           .action = "omitted",
           .result = kRefused,
           .detail = std::to_string(of.omitted) + " further refusals"},
          options_.most_waiting);
  }
}

void AuditTrail::run() {
  MutexLock lock(mutex_);
  for (;;) {
    const auto until = batch_.empty() ? window_ends_ : Clock::now() + options_.retry;
    wake_.wait_until(lock, until, [&]() OSTEON_REQUIRES(mutex_) {
      return end_ || (batch_.empty() && (!waiting_.empty() || lost_ > 0));
    });
    if (!end_ && Clock::now() >= window_ends_) end_window();
    write();
    if (end_ && (counts_.failing || (waiting_.empty() && lost_ == 0))) break;
    lock.unlock();
    maintain();
    lock.lock();
  }
  if (const std::size_t left = batch_.size() + waiting_.size(); left > 0)
    log::error("audit records are lost because the disk does not accept them", {{"records", left}});
}

void AuditTrail::write() {
  while (batch_.size() < kMostAtOnce && !waiting_.empty()) {
    batch_.push_back(std::move(waiting_.front()));
    waiting_.pop_front();
  }
  // Only once in a batch, even if the batch is tried again several times.
  const std::uint64_t lost = batch_.size() <= kMostAtOnce ? std::exchange(lost_, 0) : 0;
  if (lost > 0)
    batch_.push_back({.action = "lost",
                      .result = kLost,
                      .detail = std::to_string(lost) + " events for which the queue had no space"});
  if (batch_.empty()) return;
  const bool was_failing = counts_.failing;
  mutex_.unlock();
  const auto written = log_.append(batch_);
  if (!written && !was_failing)
    log::error("the audit log cannot be written; the server goes on, and records wait in memory",
               {{"reason", written.error().message}});
  if (written && was_failing) log::warn("the audit log is written again");
  if (written) send_to_syslog(*written);
  mutex_.lock();
  counts_.failing = !written;
  if (written) counts_.written += written->size();
}

void AuditTrail::send_to_syslog(const std::vector<AuditLog::Written>& written) {
  for (std::size_t i = 0; i < written.size(); ++i)
    (void)syslog_.send(syslog_message(written[i].record, clean(batch_[i].who), written[i].hash));
  batch_.clear();
}

void AuditTrail::maintain() {
  const auto now = Clock::now();
  if (options_.retention_days == 0 || (maintained_at_ != Clock::time_point{} && now - maintained_at_ < kMaintainEvery))
    return;
  maintained_at_ = now;
  const auto removed =
      log_.remove_before(std::chrono::system_clock::now() - std::chrono::days(options_.retention_days));
  if (!removed)
    log::error("old audit records are not removed", {{"reason", removed.error().message}});
  else if (*removed > 0)
    log::info("old audit records removed", {{"records", *removed}});
}

}  // namespace osteon
