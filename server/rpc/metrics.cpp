#include "server/rpc/metrics.hpp"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <array>
#include <cerrno>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "common/field/rejection.hpp"
#include "common/wire/host_port.hpp"
#include "server/auth/server_certificate.hpp"
#include "server/journal/journal_file.hpp"
#include "server/rpc/room_server.hpp"

namespace osteon {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;
namespace fs = std::filesystem;

// Of histograms: close around the 8 ms of a tick and the times of a disk.
constexpr std::array<double, 14> kBounds_s{0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.0085,
                                           0.0125, 0.025,   0.05,   0.1,   0.25,   0.5,   1.0};

double seconds(double us) { return us * 1e-6; }

// The families are in the order of their first use.
class Page {
 public:
  void gauge(const char* name, const char* help, Labels labels, double value) {
    ClientMetric metric;
    metric.label = std::move(labels);
    metric.gauge.value = value;
    family(name, help, MetricType::Gauge).metric.push_back(std::move(metric));
  }
  void counter(const char* name, const char* help, Labels labels, double value) {
    ClientMetric metric;
    metric.label = std::move(labels);
    metric.counter.value = value;
    family(name, help, MetricType::Counter).metric.push_back(std::move(metric));
  }
  void histogram(const char* name, const char* help, Labels labels, const DurationHistogram& durations) {
    ClientMetric metric;
    metric.label = std::move(labels);
    metric.histogram.sample_count = durations.count();
    metric.histogram.sample_sum = seconds(durations.sum_us());
    for (const double bound : kBounds_s)
      metric.histogram.bucket.push_back({durations.count_up_to(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                             std::chrono::duration<double>(bound))),
                                         bound});
    family(name, help, MetricType::Histogram).metric.push_back(std::move(metric));
  }
  [[nodiscard]] std::vector<MetricFamily> take() { return std::move(families_); }

 private:
  MetricFamily& family(const char* name, const char* help, MetricType type) {
    const auto [known, is_new] = places_.emplace(name, families_.size());
    if (is_new) families_.push_back({name, help, type, {}});
    return families_[known->second];
  }
  std::map<std::string, std::size_t> places_;
  std::vector<MetricFamily> families_;
};

double journal_bytes(const fs::path& journal) {
  double bytes = 0;
  for (const fs::path& file : {journal, wal_of(journal), log_of(journal), mirror_of(journal)}) {
    std::error_code failed;
    const std::uintmax_t size = fs::file_size(file, failed);
    if (!failed) bytes += static_cast<double>(size);
  }
  return bytes;
}

void add_room(Page& page, OpenRoom& room, bool draining) {
  const RuntimeHealth health = room.runtime().health();
  const auto with = [&](const char* name = nullptr, const std::string& value = {}) {
    Labels labels{{"room", room.name}};
    if (name) labels.push_back({name, value});
    return labels;
  };
  page.gauge("osteon_room_serving", "1 while the room takes cuts.", with(), health.serving && !draining ? 1 : 0);
  page.gauge("osteon_room_event", "Sequence number of the room's newest event.", with(),
             static_cast<double>(health.room_seq.value));

  const char* stage = "What a committed cut waits for: the tick, its decision, the disk, the streams.";
  page.histogram("osteon_cut_stage_seconds", stage, with("stage", "wait"), health.stages.wait);
  page.histogram("osteon_cut_stage_seconds", stage, with("stage", "decide"), health.stages.decide);
  page.histogram("osteon_cut_stage_seconds", stage, with("stage", "commit"), health.stages.commit);
  page.histogram("osteon_cut_stage_seconds", stage, with("stage", "publish"), health.stages.publish);
  page.histogram("osteon_tick_late_seconds", "How late ticks began.", with(), health.tick.lateness);
  page.histogram("osteon_tick_work_seconds", "How long ticks took.", with(), health.tick.work);
  page.counter("osteon_ticks_missed_total", "Periods that no tick ran in.", with(),
               static_cast<double>(health.tick.missed));
  page.histogram("osteon_journal_commit_seconds", "Transactions of the journal.", with(), health.commit);
  if (room.store())
    page.gauge("osteon_journal_bytes", "The journal's file and its log.", with(), journal_bytes(room.store_file()));

  const char* queue =
      "What waits: cuts for a tick, entries for the disk, blocks for the surface, the slowest reader's entries or "
      "blocks.";
  page.gauge("osteon_queue_length", queue, with("queue", "cuts"), static_cast<double>(health.queued_cuts));
  page.gauge("osteon_queue_length", queue, with("queue", "entries"), static_cast<double>(health.waiting_entries));
  page.gauge("osteon_queue_length", queue, with("queue", "blocks"), static_cast<double>(health.stale_blocks));
  page.gauge("osteon_queue_length", queue, with("queue", "reader"), static_cast<double>(health.furthest_behind));
  page.gauge("osteon_sessions", "Haptic clients with an open session.", with(), static_cast<double>(health.sessions));
  page.gauge("osteon_streams", "Open streams of viewers and audio clients.", with("kind", "mesh"),
             static_cast<double>(health.mesh_streams));
  page.gauge("osteon_streams", "Open streams of viewers and audio clients.", with("kind", "cutting"),
             static_cast<double>(health.cutting_streams));

  const char* cuts = "Cuts by outcome; refused ones violated the protocol.";
  page.counter("osteon_cuts_total", cuts, with("outcome", "committed"), static_cast<double>(health.counts.committed));
  page.counter("osteon_cuts_total", cuts, with("outcome", "rejected"), static_cast<double>(health.counts.rejected));
  page.counter("osteon_cuts_total", cuts, with("outcome", "repeated"), static_cast<double>(health.counts.repeated));
  page.counter("osteon_cuts_total", cuts, with("outcome", "refused"), static_cast<double>(health.counts.refused));
  for (std::size_t i = 1; i < health.rejections.size(); ++i)
    page.counter("osteon_rejections_total", "Rejected cuts by reason, since the room was opened.",
                 with("reason", std::string(kRejectionTexts[i].name)), static_cast<double>(health.rejections[i]));
}

std::vector<MetricFamily> metrics_of(RoomServer& server, const fs::path& certificate) {
  Page page;
  const bool draining = server.rooms().draining().has_value();
  const auto rooms = server.rooms().open_rooms();
  page.gauge("osteon_rooms", "Open rooms.", {}, static_cast<double>(rooms.size()));
  page.gauge("osteon_draining", "1 once the server admits nobody any more.", {}, draining ? 1 : 0);
  auto refusals = server.rooms().refusals.counts();
  for (const char* known : {"version", "request", "room", "draining", "tls"}) refusals.try_emplace(known, 0u);
  for (const auto& [reason, count] : refusals)
    page.counter("osteon_refusals_total", "Connections and calls that were refused.", {{"reason", reason}},
                 static_cast<double>(count));
  if (!certificate.empty())
    if (const Result<double> days = certificate_days_left(certificate))
      page.gauge("osteon_certificate_days_left", "Days until the server's certificate ends.", {}, *days);
  const ConnectionHealth connections = server.connection_health();
  page.gauge("osteon_connections", "Open connections.", {}, static_cast<double>(connections.connections.open));
  page.counter("osteon_connections_refused_total", "Connections closed at once, beyond the limit.", {},
               static_cast<double>(connections.connections.refused));
  page.counter("osteon_streams_ended_total", "Streams ended because the right to them had ended.", {},
               static_cast<double>(connections.authorizer.ended));
  const LinkServerHealth links = server.link_health();
  const char* paths = "Open fast paths, and those over which datagrams came recently.";
  page.gauge("osteon_links", paths, {{"state", "open"}}, static_cast<double>(links.links));
  page.gauge("osteon_links", paths, {{"state", "alive"}}, static_cast<double>(links.alive));
  page.counter("osteon_unauthenticated_datagrams_total", "Datagrams that belong to no open session.", {},
               static_cast<double>(links.unauthenticated));
  for (const std::shared_ptr<OpenRoom>& room : rooms) add_room(page, *room, draining);
  return page.take();
}

constexpr unsigned kMostConnections = 16, kPatience_s = 5;

}  // namespace

struct Metrics::Impl {
  RoomServer& server;
  const fs::path certificate;
  std::string address;
  MHD_Daemon* daemon = nullptr;

  ~Impl() {
    if (daemon) MHD_stop_daemon(daemon);
  }
  // [the HTTP library's thread]
  static MHD_Result answer(void* self, MHD_Connection* connection, const char* url, const char* method, const char*,
                           const char*, std::size_t*, void**) {
    const Impl& own = *static_cast<Impl*>(self);
    std::string text = "the figures are at /metrics\n";
    const bool found = std::string_view(url) == "/metrics" && std::string_view(method) == "GET";
    if (found) text = prometheus::TextSerializer().Serialize(metrics_of(own.server, own.certificate));
    MHD_Response* response = MHD_create_response_from_buffer(text.size(), text.data(), MHD_RESPMEM_MUST_COPY);
    if (!response) return MHD_NO;
    MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8");
    const MHD_Result queued = MHD_queue_response(connection, found ? MHD_HTTP_OK : MHD_HTTP_NOT_FOUND, response);
    MHD_destroy_response(response);
    return queued;
  }
};

Metrics::Metrics(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Metrics::~Metrics() = default;
const std::string& Metrics::address() const { return impl_->address; }

Result<std::unique_ptr<Metrics>> Metrics::start(const std::string& listen, RoomServer& server,
                                                const fs::path& certificate) {
  const Result<HostPort> at =
      parse_host_port(listen.find(':') == std::string::npos ? "127.0.0.1:" + listen : listen, "--metrics");
  if (!at) return tl::unexpected(at.error());
  if (!is_loopback(at->host))
    return failure(ErrorCode::invalid_input,
                   "--metrics " + listen +
                       " is reachable from other machines, and whoever reaches it may read it; use a "
                       "port, or one with 127.0.0.1, [::1] or localhost");
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  v4.sin_family = AF_INET;
  v6.sin6_family = AF_INET6;
  v4.sin_port = v6.sin6_port = htons(static_cast<std::uint16_t>(at->port));
  v6.sin6_addr = in6addr_loopback;
  const bool is_v6 = at->host == "[::1]";
  const std::string host = at->host == "localhost" ? "127.0.0.1" : at->host;
  if (!is_v6) ::inet_pton(AF_INET, host.c_str(), &v4.sin_addr);
  const sockaddr* place = is_v6 ? reinterpret_cast<const sockaddr*>(&v6) : reinterpret_cast<const sockaddr*>(&v4);

  auto impl = std::unique_ptr<Impl>(new Impl{server, certificate, {}});
  errno = 0;
  impl->daemon =
      MHD_start_daemon(MHD_USE_INTERNAL_POLLING_THREAD | (is_v6 ? MHD_USE_IPv6 : MHD_NO_FLAG), 0, nullptr, nullptr,
                       &Impl::answer, impl.get(), MHD_OPTION_SOCK_ADDR, place, MHD_OPTION_CONNECTION_LIMIT,
                       kMostConnections, MHD_OPTION_CONNECTION_TIMEOUT, kPatience_s, MHD_OPTION_END);
  if (!impl->daemon)
    return failure(ErrorCode::unavailable, "--metrics " + listen +
                                               " cannot be listened on: " + std::generic_category().message(errno) +
                                               "; choose another port, or 0 for a free one");
  const MHD_DaemonInfo* bound = MHD_get_daemon_info(impl->daemon, MHD_DAEMON_INFO_BIND_PORT);
  impl->address = host + ":" + std::to_string(bound ? bound->port : at->port);
  return std::unique_ptr<Metrics>(new Metrics(std::move(impl)));
}

}  // namespace osteon
