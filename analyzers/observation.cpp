#include "analyzers/observation.h"

#include "analyzers/model/bus_model.h"
#include "analyzers/model/model_events.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/sync/sync_model.h"

namespace ecaudit {

Observation::Observation(const AnalysisOptions& options, Depth depth) : pipeline_(bus_) {
  if (depth >= Depth::kSlaves) model_ = std::make_unique<model::BusModel>(pipeline_.network(), options, bus_);
  if (depth >= Depth::kClocks) sync_ = std::make_unique<sync::SyncModel>(*model_, pipeline_, bus_);
  if (depth >= Depth::kClocks) progress_ = std::make_unique<progress::ProgressModel>(*model_, bus_);
  // Who only looks at values reads them from the ENI's places as well.
  if (depth >= Depth::kClocks) bus_.Listen<model::SlavePresumed>(Stage::kModel, *this, &Observation::On);
}

void Observation::On(const model::SlavePresumed& slave) {
  pipeline_.Presume(slave.position, slave.station);
}

Observation::~Observation() = default;

void Observation::Run(capture::FrameSource& source, const PipelineOptions& options) {
  pipeline_.Run(source, options);
  if (model_) model_->Finish();
  if (sync_) sync_->Finish();
  if (progress_) progress_->Finish();
}

}  // namespace ecaudit
