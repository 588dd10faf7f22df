// A viewer asks a served room for the structures at risk of its case.
#include <filesystem>

#include "common/volume/case_scan.hpp"
#include "common/wire/plan.hpp"
#include "osteon/v1/plan.grpc.pb.h"
#include "tests/support/scenes/described_case.hpp"
#include "tests/unit/rooms/served_room.hpp"

namespace osteon {
namespace {

using namespace test;

class PlanRpc : public ServedRoom {
 protected:
  void SetUp() override {
    const CaseScan scan = turned_scan();
    const auto bone = described_ball(full_description(scan));
    ASSERT_TRUE(bone);
    ASSERT_TRUE(bone->save(dir_ / "case", scan));
    auto started = RoomServer::start(
        Room(*bone), {.listen = "127.0.0.1:0", .case_folder = dir_ / "case", .save = {}, .rates = {}}, {});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
  }
  grpc::Status get(std::uint64_t author, const wire::JoinedRoom& room, Result<SurgicalPlan>& plan) {
    v1::GetPlanRequest request;
    request.set_author(author);
    grpc::ClientContext context;
    const auto reader = v1::PlanService::NewStub(room.channel)->GetPlan(&context, request);
    wire::PlanReader whole;
    v1::GetPlanResponse message;
    while (reader->Read(&message)) EXPECT_TRUE(whole.add(message));
    plan = whole.finish();
    return reader->Finish();
  }
};

TEST_F(PlanRpc, EveryMemberIsSentThePlanAndNobodyElse) {
  const wire::JoinedRoom viewer = join(address(), wire::ClientKind::viewer);
  Result<SurgicalPlan> plan;
  for (int i = 0; i < 2; ++i) {
    const grpc::Status status = get(viewer.author.value, viewer, plan);
    ASSERT_TRUE(status.ok()) << status.error_message();
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_EQ(plan->axes.size(), 1u);
    ASSERT_EQ(plan->structures.size(), 2u);
    EXPECT_EQ(plan->structures[0].name, "Nervus ischiadicus");
    EXPECT_EQ(open_edges(plan->structures[0].surface), 0u);
    // The second time it comes from memory.
    std::filesystem::remove(dir_ / "case" / kScanFile);
  }
  EXPECT_EQ(get(9999, viewer, plan).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_FALSE(plan);
}

TEST_F(PlanRpc, AMissingScanIsSaidWithoutItsPath) {
  std::filesystem::remove(dir_ / "case" / kScanFile);
  const wire::JoinedRoom viewer = join(address(), wire::ClientKind::viewer);
  Result<SurgicalPlan> plan;
  const grpc::Status status = get(viewer.author.value, viewer, plan);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_NE(status.error_message().find(kScanFile), std::string::npos) << status.error_message();
  EXPECT_EQ(status.error_message().find(dir_.path().string()), std::string::npos) << status.error_message();
}

}  // namespace
}  // namespace osteon
