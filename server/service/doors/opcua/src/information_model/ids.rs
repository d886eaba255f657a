//! Numbers of nodes in the namespaces of the standards, and names of the instances.

/// The namespace of OPC 40100-1.
pub const MACHINE_VISION: &str = "http://opcfoundation.org/UA/MachineVision";

/// The namespace of OPC 10000-100.
pub const DEVICE_INTEGRATION: &str = "http://opcfoundation.org/UA/DI/";

/// The namespace of the instances.
pub const INSTANCES: &str = "urn:sheaf:station";

/// Types of objects and variables.
pub mod types {
    /// `VisionSystemType`.
    pub const VISION_SYSTEM: u32 = 1003;
    /// `ResultType`, of variables that contain a result.
    pub const RESULT: u32 = 2002;
}

/// Nodes of OPC 10000-100, in its namespace.
pub mod device_integration {
    /// `FunctionalGroupType`.
    pub const FUNCTIONAL_GROUP: u32 = 1005;
    /// `DeviceSet`, below which clients look for devices.
    pub const DEVICE_SET: u32 = 5001;
    /// `DeviceHealthEnumeration`.
    pub const DEVICE_HEALTH: u32 = 6244;
}

/// Types of events.
pub mod events {
    /// `JobStartedEventType`.
    pub const JOB_STARTED: u32 = 1013;
    /// `StateChangedEventType`.
    pub const STATE_CHANGED: u32 = 1018;
    /// `ErrorEventType`.
    pub const ERROR: u32 = 1019;
    /// `ErrorResolvedEventType`.
    pub const ERROR_RESOLVED: u32 = 1020;
    /// `RecipePreparedEventType`.
    pub const RECIPE_PREPARED: u32 = 1022;
    /// `ReadyEventType`.
    pub const READY: u32 = 1023;
    /// `ResultReadyEventType`.
    pub const RESULT_READY: u32 = 1024;
}

/// Types of structures.
pub mod structures {
    /// `RecipeIdExternalDataType`.
    pub const RECIPE_ID_EXTERNAL: u32 = 3002;
    /// `ProductIdDataType`.
    pub const PRODUCT_ID: u32 = 3003;
    /// `PartIdDataType`.
    pub const PART_ID: u32 = 3004;
    /// `ResultDataType`.
    pub const RESULT: u32 = 3006;
    /// `ConfigurationIdDataType`.
    pub const CONFIGURATION_ID: u32 = 3008;
    /// `RecipeIdInternalDataType`.
    pub const RECIPE_ID_INTERNAL: u32 = 3013;
    /// `MeasIdDataType`.
    pub const MEAS_ID: u32 = 3015;
    /// `JobIdDataType`.
    pub const JOB_ID: u32 = 3016;
    /// `ResultIdDataType`.
    pub const RESULT_ID: u32 = 3021;
}

/// Instances, by the path of their browse names.
pub mod instances {
    /// The vision system.
    pub const SYSTEM: &str = "VisionSystem";
    /// Its state machine.
    pub const MACHINE: &str = "VisionSystem.VisionStateMachine";
    /// The state machine within Operational.
    pub const AUTOMATIC: &str = "VisionSystem.VisionStateMachine.AutomaticModeStateMachine";
    /// Management of recipes.
    pub const RECIPES: &str = "VisionSystem.RecipeManagement";
    /// Management of results.
    pub const RESULTS: &str = "VisionSystem.ResultManagement";
    /// The folder of results.
    pub const RESULT_FOLDER: &str = "VisionSystem.ResultManagement.Results";
    /// The latest result.
    pub const LATEST_RESULT: &str = "VisionSystem.ResultManagement.Results.LatestResult";

    /// The camera.
    pub const CAMERA: &str = "VisionSystem.Camera";
    /// The stage.
    pub const STAGE: &str = "VisionSystem.Stage";
    /// The laser.
    pub const LASER: &str = "VisionSystem.Laser";

    /// Optional parts that this vision system has.
    pub const OPTIONAL: [&str; 8] = [
        AUTOMATIC,
        RECIPES,
        RESULTS,
        RESULT_FOLDER,
        "VisionSystem.ResultManagement.Results.LatestResult.IsSimulated",
        "VisionSystem.ResultManagement.Results.LatestResult.PartId",
        "VisionSystem.ResultManagement.Results.LatestResult.ExternalRecipeId",
        "VisionSystem.ResultManagement.Results.LatestResult.ResultContent",
    ];
}
